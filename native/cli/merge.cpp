// pharos-cli merge: shards of one picture to the picture.
#include <cstdio>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/picture.h"

namespace pharos::cli {

namespace {

struct Options {
    std::vector<std::string> inputs;
    std::string output;
};

Options parse(const std::vector<std::string>& arguments) {
    Options options;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        if (argument == "-o" || argument == "--output") {
            if (++i == arguments.size()) {
                throw UsageError(argument + " needs a value");
            }
            options.output = arguments[i];
        } else if (argument.starts_with("-")) {
            throw UsageError("unknown option '" + argument + "'");
        } else {
            options.inputs.push_back(argument);
        }
    }
    if (options.inputs.empty() || options.output.empty()) {
        throw UsageError("merge needs input files and -o");
    }
    return options;
}

}  // namespace

int merge(const std::vector<std::string>& arguments) {
    const Options options = parse(arguments);
    const MergedPicture picture = merge_shards(options.inputs);
    for (const SampleRange& range : picture.missing) {
        std::fprintf(stderr,
                     "pharos-cli: samples %u to %llu are in none of the files\n",
                     range.first,
                     static_cast<unsigned long long>(range.end() - 1));
    }
    write_merged(picture, options.output);
    return 0;
}

}  // namespace pharos::cli
