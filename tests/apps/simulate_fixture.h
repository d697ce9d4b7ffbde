#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// The vertices of a frame's OBJ, nine decimals each.
inline std::vector<Eigen::Vector3d> vertices_of(const std::filesystem::path& obj) {
  std::vector<Eigen::Vector3d> vertices;
  std::istringstream lines(read_file_text(obj, 1 << 20));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    Eigen::Vector3d v;
    if (words >> kind && kind == "v" && words >> v.x() >> v.y() >> v.z()) {
      vertices.push_back(v);
    }
  }
  return vertices;
}

/// A square of cloth over a pyramid, in files.
class Simulate : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run({"simulate", "--help"}).out.find("--garment") == std::string::npos) {
      GTEST_SKIP() << "built without simulate";
    }
    std::filesystem::create_directories(scene());
    write_cloth(scene() / "garment.obj", 6, 0.05);
    write_body(scene() / "body.obj", 0);
  }

  std::filesystem::path scene() const { return root_.path() / "scene"; }
  std::filesystem::path out() const { return root_.path() / "out"; }

  static void write_cloth(const std::filesystem::path& path, int cells, double size) {
    std::ofstream file(path);
    const int n = cells + 1;
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) {
        file << "v " << (c - cells / 2.0) * size << " 0.32 " << (r - cells / 2.0) * size << "\n";
      }
    }
    for (int r = 0; r < cells; ++r) {
      for (int c = 0; c < cells; ++c) {
        const int a = r * n + c + 1;
        file << "f " << a << " " << a + n << " " << a + n + 1 << "\n";
        file << "f " << a << " " << a + n + 1 << " " << a + 1 << "\n";
      }
    }
  }
  static void write_body(const std::filesystem::path& path, double x) {
    std::ofstream file(path);
    file << "v " << x << " 0.3 0\n";
    for (const auto& [cx, cz] :
         {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      file << "v " << x + 0.3 * cx << " 0 " << 0.3 * cz << "\n";
    }
    file << "f 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 2 5\nf 2 3 4\nf 2 4 5\n";
  }

  /// A sheet that hangs from its upper edge, far from the body that it is tied to.
  static void write_hanging(const std::filesystem::path& path) {
    std::ofstream file(path);
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 4; ++c) {
        file << "v " << 0.5 + 0.08 * c << " " << 1 - 0.08 * r << " 0\n";
      }
    }
    for (int r = 0; r < 5; ++r) {
      for (int c = 0; c < 3; ++c) {
        const int a = 4 * r + c + 1;
        file << "f " << a << " " << a + 4 << " " << a + 5 << "\nf " << a << " " << a + 5 << " "
             << a + 1 << "\n";
      }
    }
  }

  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program_path());
    return run_child(arguments);
  }
  ChildResult alone(std::vector<std::string> more) const {
    std::filesystem::remove_all(out());  // of a run before: a folder has to be new
    std::vector<std::string> all{"simulate", "--garment",    (scene() / "garment.obj").string(),
                                 "--out",    out().string(), "--no-pictures"};
    more = with_usual({"--settle", "5"}, more);
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
  ChildResult on_body(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--body", (scene() / "body.obj").string()});
    return alone(std::move(more));
  }
  ChildResult stage(const std::string& workspace, std::vector<std::string> more = {}) const {
    std::vector<std::string> all{"simulate", scene().string(), (root_.path() / workspace).string()};
    more = with_usual({"--settle", "6"}, more);
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
  std::string bytes(const std::string& workspace, const std::string& name) const {
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(root_.path() / workspace)) {
      if (entry.path().string().ends_with(name)) {
        return read_file_text(entry.path(), 1 << 24);
      }
    }
    return "";
  }

  TemporaryDirectory root_;
};

}  // namespace atelier::fixtures
