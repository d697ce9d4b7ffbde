// The dependency law: core <- every folder and nothing else; siblings never include each other;
// apps, tests and bench may include everything. Read off the #include lines.
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/places.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kFolders = {"core",       "capture",    "bodymodel", "registration",
                                        "simulation", "appearance", "apps"};

bool is_source(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".h" || extension == ".cpp" || extension == ".cu" || extension == ".cuh";
}

// Calls visit(file, included path) for every #include "..." in a folder.
void for_each_own_include(
    const fs::path& folder, bool recursive,
    const std::function<void(const std::string&, const std::string&)>& visit) {
  if (!fs::exists(folder)) {
    return;
  }
  const std::regex include(R"re(^\s*#\s*include\s+"([^"]+)")re");
  for (auto entry = fs::recursive_directory_iterator(folder);
       entry != fs::recursive_directory_iterator(); ++entry) {
    if (!recursive && entry->is_directory()) {
      entry.disable_recursion_pending();
    }
    if (!is_source(entry->path())) {
      continue;
    }
    std::ifstream file(entry->path());
    for (std::string line; std::getline(file, line);) {
      std::smatch match;
      if (std::regex_search(line, match, include)) {
        visit(entry->path().string(), match[1]);
      }
    }
  }
}

std::string top_folder(const std::string& path) {
  return path.substr(0, path.find('/'));
}

TEST(DependencyLaw, Siblings_NeverIncludeEachOther) {
  for (const std::string& folder : kFolders) {
    if (folder == "apps") {
      continue;
    }
    for_each_own_include(fixtures::source_directory() / folder, true,
                         [&](const std::string& file, const std::string& included) {
                           const std::string top = top_folder(included);
                           EXPECT_TRUE(top == folder || top == "core")
                               << file << " includes " << included << ": " << folder
                               << " may include core alone";
                         });
  }
}

TEST(DependencyLaw, Apps_IncludeByFullPath) {
  for_each_own_include(fixtures::source_directory() / "apps", true,
                       [](const std::string& file, const std::string& included) {
                         EXPECT_EQ(kFolders.count(top_folder(included)), 1U)
                             << file << " includes " << included;
                       });
}

// core uses none of its parts; core/io neither render nor store; those two use io alone.
TEST(DependencyLaw, PartsOfCore_KeepTheirOrder) {
  const auto check = [](const std::string& folder, const std::set<std::string>& allowed) {
    for_each_own_include(
        fixtures::source_directory() / folder, folder != "core",
        [&](const std::string& file, const std::string& included) {
          for (const std::string part : {"core/io", "core/remesh", "core/render", "core/store"}) {
            if (included.starts_with(part + "/")) {
              EXPECT_TRUE(part == folder || allowed.count(part) == 1)
                  << file << " includes " << included;
            }
          }
        });
  };
  check("core", {});
  check("core/io", {});
  check("core/remesh", {});
  check("core/render", {"core/io"});
  check("core/store", {"core/io"});
}

// Heavy packages stay in .cpp files: a header that includes one makes every user pay. The exception
// is a header that says "Private to <folder>" and that no other folder includes.
TEST(DependencyLaw, Headers_IncludeNoHeavyPackage) {
  const std::regex heavy(
      R"re(^\s*#\s*include\s+<(torch/|pcl/|CGAL/|ceres/|opencv2/|embree3/|CLI/|spdlog/|hdf5\.h|nlohmann/json\.hpp|toml\+\+/|tiny_gltf\.h|tbb/|oneapi/))re");
  const fs::path root = fixtures::source_directory();
  std::map<std::string, std::string> private_folders;  // header -> the folder that may include it
  for (const std::string& folder : kFolders) {
    if (!fs::exists(root / folder) || folder == "apps") {
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".h") {
        continue;
      }
      std::ifstream file(entry.path());
      const std::string text((std::istreambuf_iterator<char>(file)), {});
      const std::string own = fs::relative(entry.path().parent_path(), root).string();
      std::istringstream lines(text);
      for (std::string line; std::getline(lines, line);) {
        if (std::regex_search(line, heavy)) {
          EXPECT_NE(text.find("Private to " + own), std::string::npos)
              << entry.path() << ": " << line;
          private_folders[fs::relative(entry.path(), root).string()] = own;
        }
      }
    }
  }
  for (const std::string& folder : kFolders) {
    for_each_own_include(
        root / folder, true, [&](const std::string& file, const std::string& included) {
          const auto found = private_folders.find(included);
          if (found != private_folders.end()) {
            EXPECT_EQ(fs::relative(fs::path(file).parent_path(), root).string(), found->second)
                << file << " includes " << included;
          }
        });
  }
}

TEST(DependencyLaw, EveryHeader_IsGuardedOnce) {
  for (const std::string& folder : kFolders) {
    const fs::path path = fixtures::source_directory() / folder;
    if (!fs::exists(path)) {
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.path().extension() == ".h" || entry.path().extension() == ".cuh") {
        std::ifstream file(entry.path());
        std::string line;
        std::getline(file, line);
        EXPECT_EQ(line, "#pragma once") << entry.path();
      }
    }
  }
}

}  // namespace
}  // namespace atelier
