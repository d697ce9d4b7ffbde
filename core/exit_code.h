#pragma once

namespace atelier {

// Meaning of the program's exit codes; scripts may rely on it.
inline constexpr int kExitDone = 0;
inline constexpr int kExitCheckFailed = 1;   ///< a check that was asked for is not met
inline constexpr int kExitUsage = 2;         ///< the command line or an options file is wrong
inline constexpr int kExitBadData = 3;       ///< a file cannot be used
inline constexpr int kExitNotConverged = 4;  ///< an optimisation did not converge
inline constexpr int kExitEnvironment = 5;   ///< disk, memory, device, a run in the way
inline constexpr int kExitBug = 70;          ///< a defect of the program

/// The list of exit codes for --help.
inline constexpr const char* kExitCodeHelp =
    "Exit codes:\n  0  done\n  1  a requested check failed\n  2  the command line or an options "
    "file is wrong\n  3  a file cannot be used\n  4  an optimisation did not converge\n  5  the "
    "environment failed: disk, memory, device, a concurrent run\n  70 a defect of the program\nA "
    "run ended by SIGINT or SIGTERM ends by that signal (130, 143 in a shell).\n";

}  // namespace atelier
