// The table of dependencies names every shared library that the program needs.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/places.h"

namespace atelier {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string output_of(const std::string& command) {
  std::string text;
  std::array<char, 4096> buffer{};
  FILE* pipe = popen(command.c_str(), "r");
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe)) {
    text.append(buffer.data(), count);
  }
  pclose(pipe);
  return text;
}

/// "libvtkCommonCore" of "libvtkCommonCore-9.1.so.1": without versions.
std::string stem_of(const std::string& soname) {
  const std::string name = soname.substr(0, soname.find(".so"));
  const std::size_t dash = name.rfind('-');
  const bool version = dash != std::string::npos && dash + 1 < name.size() &&
                       name.find_first_not_of("0123456789._", dash + 1) == std::string::npos;
  const std::string stem = version ? name.substr(0, dash) : name;
  return stem.ends_with("-3_1") ? stem.substr(0, stem.size() - 4) : stem;
}

/// The libraries that a file asks the loader for, but the compiler's and the system's own.
std::set<std::string> needed_by(const std::string& file) {
  static const std::set<std::string> own = {
      "libc", "libm", "libstdc++", "libgcc_s", "libpthread", "ld-linux-x86", "ld-linux-x86-64"};
  std::set<std::string> needed;
  std::istringstream lines(output_of("readelf -d '" + file + "' 2>/dev/null"));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t open = line.find('[');
    if (line.find("(NEEDED)") != std::string::npos && open != std::string::npos) {
      const std::string stem = stem_of(line.substr(open + 1, line.find(']') - open - 1));
      if (!own.contains(stem)) {
        needed.insert(stem);
      }
    }
  }
  return needed;
}

/// The program and what it loads late.
std::vector<std::string> parts_of_program() {
  std::vector<std::string> parts = {fixtures::program_path()};
  const std::filesystem::path program = fixtures::program_path();
  for (const auto& entry :
       std::filesystem::directory_iterator(program.parent_path().parent_path() / "lib")) {
    if (entry.path().extension() == ".so") {
      parts.push_back(entry.path().string());
    }
  }
  return parts;
}

std::set<std::string> needed_by_program() {
  std::set<std::string> needed;
  for (const std::string& part : parts_of_program()) {
    needed.merge(needed_by(part));
  }
  return needed;
}

/// Every word of the tables' last columns that names a shared library.
std::set<std::string> listed_libraries() {
  std::ifstream document(fixtures::source_directory() / "docs/reference/dependencies.md");
  std::set<std::string> listed;
  for (std::string line; std::getline(document, line);) {
    if (!line.starts_with("| ") || !line.ends_with("|")) {
      continue;
    }
    const std::size_t last = line.rfind('|', line.size() - 2);
    std::string files = line.substr(last + 1, line.size() - last - 2);
    for (char& c : files) {
      c = c == ',' ? ' ' : c;
    }
    std::istringstream words(files);
    for (std::string word; words >> word;) {
      if (word.starts_with("lib")) {
        listed.insert(word);
      }
    }
  }
  return listed;
}

TEST(Dependencies, LibraryStems_HaveNoVersions) {
  EXPECT_EQ(stem_of("libvtkCommonCore-9.1.so.1"), "libvtkCommonCore");
  EXPECT_EQ(stem_of("libglib-2.0.so.0"), "libglib");
  EXPECT_EQ(stem_of("libOpenEXR-3_1.so.30"), "libOpenEXR");
  EXPECT_EQ(stem_of("libavcodec.so.59"), "libavcodec");
}

/// The names between the brackets of the script's lists.
std::set<std::string> packages_of_setup() {
  std::ifstream script(fixtures::source_directory() / "scripts/setup");
  std::set<std::string> packages;
  bool inside = false;
  for (std::string line; std::getline(script, line);) {
    line = line.substr(0, line.find('#'));
    const std::size_t open = line.find("=(");
    const bool list =
        open != std::string::npos && (line.starts_with("build=") || line.starts_with("checks=") ||
                                      line.starts_with("judges=") || line.starts_with("opens_in="));
    if (!inside && !list) {
      continue;
    }
    std::istringstream words(list ? line.substr(open + 2) : line);
    inside = true;
    for (std::string word; words >> word;) {
      inside = inside && !word.ends_with(")");
      const std::string name = word.substr(0, word.find(')'));
      if (!name.empty()) {
        packages.insert(name);
      }
    }
  }
  return packages;
}

/// The words of the column "of Debian".
std::set<std::string> listed_packages() {
  std::ifstream document(fixtures::source_directory() / "docs/reference/dependencies.md");
  std::set<std::string> listed;
  bool table = false;
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with("| package |")) {
      table = line.starts_with("| package | of Debian |");
    }
    if (!table || !line.starts_with("| ")) {
      continue;
    }
    const std::size_t begin = line.find('|', 1) + 1;
    std::string cell = line.substr(begin, line.find('|', begin) - begin);
    std::replace(cell.begin(), cell.end(), ',', ' ');
    std::istringstream words(cell);
    for (std::string word; words >> word;) {
      listed.insert(word);
    }
  }
  return listed;
}

TEST(Dependencies, EveryInstalledPackage_IsInTheTables) {
  const std::set<std::string> packages = packages_of_setup();
  EXPECT_GT(packages.size(), 40U);
  const std::set<std::string> listed = listed_packages();
  for (const std::string& package : packages) {
    EXPECT_THAT(listed, Contains(package));
  }
}

// Each of these brings a hundred others (docs/decisions/0009-heavy-libraries-late.md).
TEST(Dependencies, Program_StartsWithoutHeavyLibraries) {
  if (fixtures::program_path().empty()) {
    GTEST_SKIP() << "the program is not built";
  }
  const std::string loaded = output_of("ldd '" + fixtures::program_path() + "' 2>/dev/null");
  ASSERT_THAT(loaded, HasSubstr("libc.so"));
  for (const char* heavy : {"libopencv_imgcodecs", "libopencv_videoio", "libavformat", "libpcl_",
                            "libvtk", "libgdal", "libtorch"}) {
    EXPECT_THAT(loaded, Not(HasSubstr(heavy)));
  }
}

TEST(Dependencies, DirectLibraries_AreInTheTable) {
  if (fixtures::program_path().empty()) {
    GTEST_SKIP() << "the program is not built";
  }
  const std::set<std::string> listed = listed_libraries();
  const std::set<std::string> needed = needed_by_program();
  ASSERT_THAT(needed, Not(IsEmpty())) << "readelf says nothing of " << fixtures::program_path();
  for (const std::string& library : needed) {
    EXPECT_THAT(listed, Contains(library));
  }
}

TEST(Dependencies, IndirectLibraries_AreInTheTable) {
  if (fixtures::program_path().empty()) {
    GTEST_SKIP() << "the program is not built";
  }
  const std::set<std::string> listed = listed_libraries();
  const std::set<std::string> direct = needed_by_program();
  std::string loaded;
  for (const std::string& part : parts_of_program()) {
    loaded += output_of("ldd '" + part + "' 2>/dev/null");
  }
  std::istringstream lines(loaded);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string soname;
    std::string arrow;
    std::string path;
    words >> soname >> arrow >> path;
    const std::string stem = stem_of(soname);
    // The codecs of FFmpeg and libavif are some sixty: the document says so.
    if (!direct.contains(stem) || stem.starts_with("libav")) {
      continue;
    }
    for (const std::string& library : needed_by(path)) {
      EXPECT_THAT(listed, Contains(library)) << "needed by " << stem;
    }
  }
}

}  // namespace
}  // namespace atelier
