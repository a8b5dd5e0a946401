// pharos-cli: renders dump files without Blender, bit-equal to what Blender shows.
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "cli/commands.h"

namespace {

constexpr const char* kUsage =
    "usage: pharos-cli render FILE -o OUT.exr [options]\n"
    "  --samples N        samples per pixel (default: the file's)\n"
    "  --seed N           seed (default: the file's)\n"
    "  --threads N        threads (default: one per core)\n"
    "  --guiding MODE     off, neural, slides, slides-position (default: the file's)\n"
    "  --nee on|off       next-event estimation (default: the file's)\n"
    "  --time-limit S     stop after S seconds\n"
    "  --passes A,B       passes beside the basic ones: names, all, guide or none (default: the "
    "file's)\n"
    "  --snapshots A,B    also write OUT.A.exr, OUT.B.exr after that many samples\n"
    "  --stats            print work and time per stage\n"
    "  --stats-json FILE  write the same, with the snapshots' CPU seconds, as JSON\n"
    "       pharos-cli field FILE --pixel X,Y -o OUT.exr [options]\n"
    "  what the guide believes at a pixel's first hit (left) beside the light that is there "
    "(right),\n"
    "  as latitude-longitude pictures, also OUT.png; (0, 0) is the pixel bottom left\n"
    "  --samples, --seed, --threads, --guiding, --nee as above; --guiding off counts as neural\n"
    "  --load FILE        start from saved weights; without --samples they do not learn on\n"
    "  --save FILE        write the weights\n"
    "  --height N         rows of each picture (default: 64)\n"
    "  --rays N           paths into each direction (default: 64)\n"
    "       pharos-cli adapt FILE --move X,Y,Z [options]\n"
    "  error of every frame after a lamp has moved: guide kept, from nothing, without\n"
    "  --lamp NAME        default: the first\n"
    "  --frames N         after the move (default: 24)\n"
    "  --learned N        frames before it (default: 64)\n"
    "  --reference N      samples of the reference (default: 256)\n"
    "  --size W,H         of the picture (default: the file's)\n"
    "  --seed, --threads, --nee as above\n"
    "exit codes: 0 done, 1 error, 2 wrong arguments, 130 interrupted, 143 terminated (both write "
    "OUT)\n";

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
        std::fputs("pharos-cli: this processor lacks AVX2 and FMA\n", stderr);
        return 1;
    }
    if (arguments.empty() || arguments[0] == "--help" || arguments[0] == "-h") {
        std::fputs(kUsage, arguments.empty() ? stderr : stdout);
        return arguments.empty() ? 2 : 0;
    }
    try {
        if (arguments[0] == "render") {
            return pharos::cli::render({arguments.begin() + 1, arguments.end()});
        }
        if (arguments[0] == "field") {
            return pharos::cli::field({arguments.begin() + 1, arguments.end()});
        }
        if (arguments[0] == "adapt") {
            return pharos::cli::adapt({arguments.begin() + 1, arguments.end()});
        }
        std::fprintf(stderr, "pharos-cli: unknown command '%s'\n%s", arguments[0].c_str(), kUsage);
        return 2;
    } catch (const pharos::cli::UsageError& error) {
        std::fprintf(stderr, "pharos-cli: %s\n%s", error.what(), kUsage);
        return 2;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "pharos-cli: %s\n", error.what());
        return 1;
    }
}
