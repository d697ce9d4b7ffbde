#pragma once

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "tests/apps/places_with.h"
#include "tests/apps/statistics_fixture.h"

namespace atelier::fixtures {

/// A small workspace, keys, and what is sealed of it.
class Seal : public StatisticsFixture {
 protected:
  void SetUp() override { write_boxes(input(), 2); }

  std::string place(const std::string& name) const { return (root_ / name).string(); }
  void make_workspace(const std::string& scope = "research",
                      const std::string& until = "2999-12-31") const {
    if (!scope.empty()) {
      std::ofstream(root_ / "consent.toml")
          << "[consent]\nwho = 'P. Doe'\nscope = '" << scope << "'\nuntil = '" << until << "'\n";
    }
    ASSERT_EQ(run_child(statistics()).exit_code, 0);
  }
  /// A new key; its recipient.
  std::string key(const std::string& name) const {
    const ChildResult result = run({"key", "--out", place(name)});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out.substr(0, result.out.find('\n'));
  }
  ChildResult seal(std::vector<std::string> more) const {
    more.insert(more.begin(), {"seal", workspace().string(), "--out", place("p.sealed")});
    return run(more);
  }
  ChildResult unseal(const std::string& key, const std::string& out) const {
    return run({"unseal", place("p.sealed"), place(out), "--identity", place(key)});
  }
  std::string bytes(const std::string& name) const { return read_file_text(root_ / name, 1 << 24); }
  /// Whether nothing but these lies beside the input, the workspace and the consent.
  std::vector<std::string> others(const std::set<std::string>& known) const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(root_.path())) {
      const std::string name = entry.path().filename().string();
      if (!known.contains(name) && name != "boxes" && name != "work" && name != "consent.toml") {
        names.push_back(name);
      }
    }
    return names;
  }
};

}  // namespace atelier::fixtures
