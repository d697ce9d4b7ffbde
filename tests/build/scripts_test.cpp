// What the scripts say of arguments, and how the demo goes on.
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

TEST(ScriptsRefused, OptionWithoutValue_IsRefused) {
  const std::vector<std::vector<std::string>> commands = {
      {"lint", "--build"}, {"lint", "--base"},   {"lint", "--base", ""},
      {"lint", "--bas"},   {"test", "--preset"}, {"test", "--pres"}};
  for (std::vector<std::string> command : commands) {
    const std::string name = command[0];
    command[0] = (source_directory() / "scripts" / name).string();
    SCOPED_TRACE(name + " " + command[1]);
    const ChildResult result = run_child(command);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, ::testing::StartsWith("usage: scripts/" + name + " ["));
  }
}

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ChildResult run_script(const std::string& name, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), (source_directory() / "scripts" / name).string());
  return run_child(arguments);
}

TEST(Lint, MissingGitRevision_IsReported) {
  const TemporaryDirectory folder;
  fs::create_directories(folder / "scripts");
  fs::copy_file(source_directory() / "scripts/lint", folder / "scripts/lint");
  const ChildResult result = run_child({(folder / "scripts/lint").string()});
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_THAT(result.err, HasSubstr("git knows no revision here"));
}

TEST(ApiReference, PublicHeaders_GiveNoWarning) {
  const TemporaryDirectory folder;
  const ChildResult result = run_script("api-reference", {folder.path().string()});
  if (result.exit_code == 5) {
    GTEST_SKIP() << result.err;
  }
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::exists(folder / "html/index.html"));
}

TEST(Scripts, EveryScript_PrintsHelp) {
  for (const auto& entry : fs::directory_iterator(source_directory() / "scripts")) {
    if (!entry.is_regular_file()) {
      continue;
    }
    SCOPED_TRACE(entry.path().string());
    for (const char* flag : {"--help", "-h"}) {
      const ChildResult result = run_script(entry.path().filename().string(), {flag});
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_THAT(result.out, HasSubstr("scripts/" + entry.path().filename().string()));
    }
  }
}

TEST(ScriptsRefused, UnknownArguments_AreRefused) {
  EXPECT_EQ(run_script("gpu", {"--foo"}).exit_code, 2);
  EXPECT_EQ(run_script("gpu-appearance", {}).exit_code, 2);
  EXPECT_EQ(run_script("gpu-appearance", {"--data"}).exit_code, 2);
  EXPECT_EQ(run_script("gpu-appearance", {"nothing.h5"}).exit_code, 3);
}

TEST(ScriptsRefused, MissingTestResults_AreAFailure) {
  const TemporaryDirectory folder;
  for (const fs::path& place : {folder.path(), folder / "missing"}) {
    const ChildResult result = run_script("count-tests", {place.string()});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("no results of tests"));
  }
}

TEST(ScriptsRefused, OpensInWithoutAnAnimation_SaysWhatItNeeds) {
  EXPECT_EQ(run_script("opens-in", {"capture"}).exit_code, 2);
  const TemporaryDirectory folder;
  const ChildResult result = run_script("opens-in", {"capture", folder.path().string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("has no result of animate"));
}

/// The page that scripts/opens-in prints, as it stands in docs.
TEST(OpensIn, Page_HasTheLinesOfItsTemplateAndManyPrograms) {
  std::istringstream lines(read_text(source_directory() / "docs/opens_in.md.in"));
  std::istringstream page(read_text(source_directory() / "docs/reference/opens_in.md"));
  std::set<std::string> programs;
  std::string found;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("@table ")) {
      ASSERT_TRUE(std::getline(page, found));
      EXPECT_EQ(found, line) << "scripts/opens-in prints the page again";
      continue;
    }
    for (std::size_t row = 0; page.peek() == '|' && std::getline(page, found); ++row) {
      if (row >= 2) {  // behind the head
        programs.insert(found.substr(2, found.find_first_of("0123456789", 2) - 2));
      }
    }
  }
  EXPECT_GE(programs.size(), 14U);
  ASSERT_TRUE(std::getline(page, found) && found.empty());
  ASSERT_TRUE(std::getline(page, found));
  EXPECT_THAT(found, ::testing::StartsWith("Commit: "));
}

/// Tests that the page names, in its code spans: "Suite.Condition_Result".
TEST(OpensIn, TestsThatThePageNames_AreThere) {
  std::string sources;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(source_directory() / "tests")) {
    if (entry.path().extension() == ".cpp") {
      sources += read_text(entry.path());
    }
  }
  const std::string page = read_text(source_directory() / "docs/opens_in.md.in");
  const std::regex name("`([A-Z][A-Za-z0-9]+)\\.([A-Z][A-Za-z0-9]+_[A-Za-z0-9]+)`");
  int named = 0;
  for (std::sregex_iterator at(page.begin(), page.end(), name); at != std::sregex_iterator();
       ++at) {
    const std::string both = (*at)[1].str() + ", " + (*at)[2].str() + ")";
    EXPECT_NE(sources.find("(" + both), std::string::npos) << both;
    ++named;
  }
  EXPECT_GE(named, 40);
}

/// A function of that many lines.
std::string function_of(int lines, const std::string& signature) {
  std::string text = signature + " {\n";
  for (int i = 2; i < lines; ++i) {
    text += i % 2 == 0 ? "  // }\n" : "  say(\"}{\", '}');\n";
  }
  return text + "}\n";
}

TEST(LongFunctions, LongOrManyParameters_Fail) {
  const TemporaryDirectory folder;
  std::ofstream(folder / "thing.cpp")
      << "namespace a {\n"
      << function_of(119, "int short_enough(int a,\n    int b)")
      << function_of(121, "template <class T>\nint too_long(std::map<int, T> a)") << "}\n"
      << "int hidden(int a, int b, int c, int d, int e, int f, int g);\n";
  std::ofstream(folder / "thing.h")
      << "int six(int a, std::map<int, int> b, int c, int d = f(1, 2), int e = {}, int g = 1);\n"
      << "int seven(int a, int b, int c, int d, int e, int f, int g);\n"
      << "class Thing {\n public:\n  Thing(int a, int b, int c, int d, int e, int f, int g);\n"
      << " private:\n  void inner(int a, int b, int c, int d, int e, int f, int g);\n};\n";
  std::ofstream(folder / "thing_math.h")
      << "inline int shared(int a, int b, int c, int d, int e, int f, int g) { return a; }\n";
  const ChildResult result = run_script("long-functions", {folder.path().string()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out,
              ::testing::AllOf(HasSubstr("of 3 the longest is too_long, 122 lines"),
                               HasSubstr("thing.cpp:122: too_long: 122 lines, at most 120"),
                               HasSubstr("thing.h:2: seven: 7 parameters, at most 6"),
                               HasSubstr("thing.h:5: Thing: 7 parameters")));
  for (const char* fine : {"short_enough: ", "six: ", "inner: ", "shared: ", "hidden: "}) {
    EXPECT_THAT(result.out, ::testing::Not(HasSubstr(fine)));
  }
  const ChildResult allowed =
      run_script("long-functions", {"--lines", "122", "--parameters", "7", folder.path().string()});
  EXPECT_EQ(allowed.exit_code, 0) << allowed.out;
}

TEST(ScriptsRefused, FolderWithoutFunctions_IsAnError) {
  const TemporaryDirectory folder;
  const ChildResult result = run_script("long-functions", {folder.path().string()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no function found"));
}

/// `scripts/demo` in a tree where nothing is set up or built, and the program notes what it is told
/// and refuses what is wrong.
class Demo : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(tree_ / "scripts");
    fs::create_directories(tree_ / "build/dev/bin");
    fs::create_directories(tree_ / "tools");
    fs::create_directories(caller_);
    fs::copy(source_directory() / "scripts/demo", tree_ / "scripts/demo");
    script("scripts/setup", "exit 0");
    script("tools/cmake", "exit 0");
    script("build/dev/bin/atelier",
           "echo \"$*\" >>'" + (root_ / "told").string() +
               "'\n"
               "case \" $* \" in\n"
               "  *\" --dry-run \"*) [[ $* != *wrong* ]] || { echo wrong >&2; exit 2; } ;;\n"
               "  *\" late \"*) exit 3 ;;\n"
               "  \" synthesize \"*) mkdir -p \"$2\" ;;\n"
               "  \" run \"*) mkdir -p \"$3/report\" ;;\n"
               "esac");
  }
  void script(const fs::path& name, const std::string& text) const {
    std::ofstream(tree_ / name) << "#!/usr/bin/env bash\n" << text << "\n";
    fs::permissions(tree_ / name, fs::perms::owner_all);
  }
  /// From another folder than the tree.
  ChildResult demo(const std::string& arguments) const {
    return run_child({"bash", "-c",
                      "cd '" + caller_.string() + "' && PATH='" + (tree_ / "tools").string() +
                          "':$PATH '" + (tree_ / "scripts/demo").string() + "' " + arguments});
  }
  std::string told() const { return fs::exists(root_ / "told") ? read_text(root_ / "told") : ""; }

  TemporaryDirectory root_;
  fs::path tree_ = root_ / "tree";
  fs::path caller_ = root_ / "caller";
};

TEST_F(Demo, FreshFolder_IsFilledAndSaysHowToContinue) {
  const ChildResult done = demo("out1 -- --seed 3");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_TRUE(fs::exists(caller_ / "out1/workspace"));
  EXPECT_THAT(told(), HasSubstr("synthesize " + (caller_ / "out1/capture").string() +
                                " --preset demo --seed 3\n"));
  const ChildResult again = demo("out1");
  EXPECT_EQ(again.exit_code, 2);
  const std::string program = (tree_ / "build/dev/bin/atelier").string();
  const std::string capture = (caller_ / "out1/capture").string();
  const std::string workspace = (caller_ / "out1/workspace").string();
  EXPECT_THAT(again.err, HasSubstr(program + " run " + capture + " " + workspace + "\n"));
  EXPECT_THAT(again.err, HasSubstr(program + " evaluate " + workspace + " --ground-truth " +
                                   capture + " --check\n"));
}

TEST_F(Demo, InterruptedCapture_IsResumed) {
  fs::create_directories(caller_ / "out1/capture/.unfinished");
  EXPECT_EQ(demo("out1").exit_code, 0);
}

TEST_F(Demo, RefusedCapture_LeavesThePlaceFree) {
  EXPECT_EQ(demo("out1 -- --wrong").exit_code, 2);
  EXPECT_THAT(told(), ::testing::Not(HasSubstr("--wrong\n"))) << "told before anything is made";
  EXPECT_EQ(demo("out1 -- late").exit_code, 3);
  EXPECT_FALSE(fs::exists(caller_ / "out1"));
  EXPECT_EQ(demo("out1").exit_code, 0);
}

TEST_F(Demo, FolderOfOtherThings_IsRefused) {
  fs::create_directories(caller_ / "out1/letters");
  std::ofstream(caller_ / "file") << "x";
  for (const char* place : {"out1", "file", "''", "--foo", "out2 --foo"}) {
    EXPECT_EQ(demo(place).exit_code, 2) << place;
  }
  EXPECT_THAT(told(), IsEmpty());
}

}  // namespace
}  // namespace atelier::fixtures
