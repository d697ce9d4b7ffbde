#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace atelier {

/// Where other programs of Atelier lie, if not in the same folder as this one: for an interpreter
/// that has loaded the libraries. An empty path: in the same folder.
void set_program_folder(const std::filesystem::path& folder);

/// True if a program of that name lies in the same folder as this one and may be run.
bool has_child_program(const std::string& name);

/// Runs a program that lies in the same folder as this one and waits for it. Lines that it prints
/// go to `on_line` as they come; when `stop` says so it gets SIGTERM, once, and may still end its
/// work. True if it did what it was asked; false if it was stopped.
///
/// Its error message is thrown, by its exit code: DataError (3), EnvironmentError (4, 5, one that
/// was killed, and a program that is not there, with `missing` as what to do), LogicError (else).
bool run_child_program(const std::string& name, const std::vector<std::string>& arguments,
                       const std::string& missing,
                       const std::function<void(const std::string& line)>& on_line,
                       const std::function<bool()>& stop);

}  // namespace atelier
