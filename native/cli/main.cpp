// pharos-cli: renders dump files without Blender, bit-equal to what Blender shows.
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "core/atomic_file.h"
#include "core/memory.h"

namespace {

constexpr const char* kUsage =
    "usage: pharos-cli render FILE -o OUT.exr [options]\n"
    "  --samples N        samples per pixel (default: the file's)\n"
    "  --seed N           seed (default: the file's)\n"
    "  --threads N        threads (default: one per core)\n"
    "  --guiding MODE     off, neural, slides (default: the file's); for comparison "
    "slides-position,\n"
    "                     slides-mixture, neural-reflection, neural-radiance\n"
    "  --nee on|off       next-event estimation (default: the file's)\n"
    "  --time-limit S     stop after S seconds\n"
    "  --passes A,B       passes beside the basic ones: names, all, guide or none (default: the "
    "file's)\n"
    "  --sample-offset N  with --sample-count M: the samples N to N+M-1 of the picture, for merge\n"
    "  --field FILE       guide by what another render has learned, and learn no more\n"
    "  --save-field FILE  write what was learned\n"
    "  --checkpoint FILE  keep the render in a file, every 300 seconds and at its end\n"
    "  --checkpoint-interval S   every S seconds\n"
    "  --resume           go on from that file, if it is there\n"
    "  --strict           a missing image is an error\n"
    "  --snapshots A,B    also write OUT.A.exr, OUT.B.exr after that many samples\n"
    "  --pass-samples N   samples of a pass at most, 1 to learn after every sample\n"
    "  --stats            print work and time per stage\n"
    "  --stats-json FILE  write the same, with the snapshots' seconds, as JSON\n"
    "       pharos-cli merge A.exr B.exr ... -o OUT.exr\n"
    "  pictures of --sample-offset and --sample-count to one, each pixel by its own samples\n"
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
    "  --seeds N          errors are means over so many (default: 3)\n"
    "  --seed, --threads, --nee as above\n"
    "       pharos-cli settle FILE [options]\n"
    "  error of a live picture by seconds, guided and not, and the size at which all of the guide\n"
    "  fits into 16 ms a frame\n"
    "  --seconds N,N,...  CPU seconds over threads (default: 1,2,4,8)\n"
    "  --turns N          of each (default: 2)\n"
    "  --budget MS        of the guide in a frame (default: 16)\n"
    "  --frame MS         what a frame is where a sample takes longer (default: 33.3)\n"
    "  --reference, --size, --seed, --threads, --nee as above\n"
    "       pharos-cli animate FILE --move X,Y,Z [options]\n"
    "  error x CPU time of the frames of an animation in which a lamp moves: the guide goes on "
    "from\n"
    "  frame to frame, or starts from nothing in each\n"
    "  --frames N         (default: 24)\n"
    "  --cut              the lamp moves all the way at once, in the middle\n"
    "  --lamp, --samples, --reference, --size, --seed, --threads, --nee as above\n"
    "exit codes: 0 done, 1 error, 2 wrong arguments, 3 missing image (--strict), 4 out of memory,\n"
    "5 not written, 130 interrupted, 143 terminated (both write OUT)\n";

struct Command {
    const char* name;
    int (*run)(const std::vector<std::string>& arguments);
};

constexpr Command kCommands[] = {{"render", pharos::cli::render},
                                 {"merge", pharos::cli::merge},
                                 {"field", pharos::cli::field},
                                 {"adapt", pharos::cli::adapt},
                                 {"settle", pharos::cli::settle},
                                 {"animate", pharos::cli::animate}};

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
    const auto complain = [](const char* what) { std::fprintf(stderr, "pharos-cli: %s\n", what); };
    try {
        for (const Command& command : kCommands) {
            if (arguments[0] == command.name) {
                return command.run({arguments.begin() + 1, arguments.end()});
            }
        }
        throw pharos::cli::UsageError("unknown command '" + arguments[0] + "'");
    } catch (const pharos::cli::UsageError& error) {
        complain(error.what());
        std::fputs(kUsage, stderr);
        return pharos::cli::kExitUsage;
    } catch (const pharos::cli::MissingAsset& error) {
        complain(error.what());
        return pharos::cli::kExitMissingAsset;
    } catch (const pharos::WriteError& error) {
        complain(error.what());
        return pharos::cli::kExitNotWritten;
    } catch (const std::exception& error) {
        const bool memory = pharos::is_out_of_memory(error);
        complain(memory ? "out of memory: the scene does not fit" : error.what());
        return memory ? pharos::cli::kExitOutOfMemory : pharos::cli::kExitError;
    }
}
