#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace atelier::fixtures {

/// A source of the project, as far as the dependency law reads it.
struct LawSource {
  std::string path;  ///< from the project's folder, such as "capture/layouts/colmap.h"
  std::string text;
};

/// What breaks the dependency law in a list of sources, a line each; empty if nothing does.
///
///     core <- capture, bodymodel, registration, simulation, appearance <- pipeline <- apps, python
///
/// - A file includes its own top folder and those to the left of it, by the full path; nothing
///   includes tests, bench, examples or fuzz, which may include everything.
/// - A room is the folder of a file; a folder `late`, whose file is a shared object loaded on
///   demand, counts as the one that it is in. Rooms do not include each other in a cycle.
/// - core's own files use none of its rooms; core/render and core/store use core/io alone, core/io,
///   core/remesh and core/seal none of the others.
/// - pipeline includes neither CLI11 nor a header of streams (<iostream>, <fstream>, <sstream>).
/// - A heavy package is included in .cpp files alone, or in a header that says
///   "Private to <folder>" and that no other folder includes. apps, which nobody includes, may do
///   as it likes, and headers of pipeline may include what pipeline/precompiled.h has parsed for
///   all its users.
/// - A header begins with #pragma once.
/// - apps and pipeline do not know which solvers there are: the word XPBD stands there only in
///   names of options ("xpbd.drag"), and these only where rules between options are, in files
///   *_rules.
/// - apps and pipeline have no branches for packages that are missing: a missing package leaves out
///   a room, or the file of a command, which apps/console/commands.cpp alone asks for.
/// - apps has at most 10,000 lines: console and commands alone.
std::vector<std::string> law_violations(const std::vector<LawSource>& sources);

/// The sources and headers of the folders that the law is about.
std::vector<LawSource> read_law_sources(const std::filesystem::path& project);

}  // namespace atelier::fixtures
