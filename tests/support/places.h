#pragma once

#include <filesystem>
#include <string>

namespace atelier::fixtures {

// Known to one source alone (tests/main.cpp), so that every other object is the same wherever the
// project lies and a compiler cache serves them all.

/// Folder of the project's sources.
std::filesystem::path source_directory();

/// The program under test; empty in a test program that runs none.
std::string program_path();

/// The program with its stages and `status` alone, which starts in milliseconds; or empty.
std::string small_program_path();

}  // namespace atelier::fixtures
