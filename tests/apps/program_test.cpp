// The command line as a whole: help, version, completion, options, the last resort.

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "tests/apps/program_fixture.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST_F(Program, Help_ListsStagesCommandsAndExitCodes) {
  const ChildResult result = run({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"statistics", "status", "inspect", "gc", "convert", "options",
                           "completion", "Exit codes:", "70 a defect"}) {
    EXPECT_THAT(result.out, HasSubstr(word));
  }
  EXPECT_THAT(result.err, IsEmpty());
}

TEST_F(Program, HelpCommand_EqualsTheHelpFlag) {
  EXPECT_EQ(run({"help", "inspect"}).out, run({"inspect", "--help"}).out);
}

TEST_F(Program, NoArguments_AreAUsageErrorWithHelp) {
  const ChildResult result = run({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.out, HasSubstr("Usage: atelier COMMAND"));
}

TEST_F(Program, EveryCommand_HasHelp) {
  for (const char* command :
       {"statistics", "status", "inspect", "gc", "convert", "options", "completion"}) {
    const ChildResult result = run({command, "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr(std::string("atelier ") + command));
    EXPECT_THAT(result.out, HasSubstr("Exit codes:"));
  }
}

TEST_F(Program, FlagWithoutValue_GivesASentence) {
  expect_refusal(run({"convert", "a.obj", "b.obj", "--input.unit"}), 2,
                 "--input.unit needs a value behind it: m|dm|cm|mm|in|ft; see atelier convert");
  expect_refusal(run({"statistics", "--jobs"}), 2, "--jobs needs a value behind it");
}

TEST_F(Program, DashesAndUnderscores_AreInterchangeable) {
  write_boxes(input(), 1);
  for (const char* flag : {"--statistics.edge_quantiles", "--statistics.edge-quantiles"}) {
    EXPECT_EQ(run_statistics({flag, "0.5", "--dry_run"}).exit_code, 0) << flag;
  }
  EXPECT_FALSE(std::filesystem::exists(workspace())) << "--dry_run is --dry-run";
  EXPECT_THAT(run({"statistics", "--help"}).out,
              AllOf(HasSubstr("--statistics.edge-quantiles"), Not(HasSubstr("edge_quantiles"))));
}

TEST_F(Program, BooleanFlags_TakeBlankOrEqualsSign) {
  write_boxes(input(), 1);
  for (const std::vector<std::string>& flag :
       {std::vector<std::string>{"--dry-run", "true"}, {"--dry-run=true"}, {"--dry-run"}}) {
    EXPECT_EQ(run_statistics(flag).exit_code, 0);
    EXPECT_FALSE(std::filesystem::exists(workspace())) << flag.back();
  }
  for (const std::vector<std::string>& flag :
       {std::vector<std::string>{"--json", "false"}, {"--json=false"}}) {
    EXPECT_THAT(run_statistics(flag).out, Not(StartsWith("{"))) << flag.back();
  }
}

TEST_F(Program, UnknownFlag_SuggestsTheMatchingOption) {
  expect_refusal(run({"convert", "a.obj", "b.obj", "--unit", "cm"}), 2,
                 "convert has no option '--unit', did you mean '--input.unit'?");
}

TEST_F(Program, Version_NamesTheBuild) {
  EXPECT_THAT(run({"--version"}).out, StartsWith("atelier "));
}

TEST_F(Program, Help_ListsEveryChoiceOnce) {
  EXPECT_THAT(run({"statistics", "--help"}).out,
              AllOf(HasSubstr("--device cpu "), HasSubstr("--input.up x|y|z "),
                    Not(HasSubstr("{x")), Not(HasSubstr("{cpu"))));
  EXPECT_THAT(run({"body-model", "--help"}).out, Not(HasSubstr("{show")));
}

TEST_F(Program, Usage_NamesTheCommandOnce) {
  EXPECT_THAT(run({"statistics", "--help"}).out,
              HasSubstr("Usage: atelier statistics [OPTIONS] INPUT WORKSPACE"));
}

TEST_F(Program, FormerNameOfCommand_RunsWithWarning) {
  const ChildResult now = run({"render-neural", "--help"});
  if (now.exit_code != 0) {
    GTEST_SKIP() << "this build has no networks";
  }
  const ChildResult former = run({"draw", "--help"});
  EXPECT_EQ(former.exit_code, 0);
  EXPECT_EQ(former.out, now.out);
  EXPECT_EQ(former.err, "warning: 'atelier draw' is now 'atelier render --neural'\n");
  EXPECT_EQ(run({"render", "--neural", "--help"}).out, now.out);
}

TEST_F(Program, EveryOption_IsInHelpAndDocument) {
  const std::string document = run({"options", "--markdown"}).out;
  EXPECT_THAT(document, HasSubstr("## atelier convert"));
  std::istringstream lines(document);
  std::string help;
  int options = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## atelier ")) {
      help = run({line.substr(11), "--help"}).out;
    } else if (!help.empty() && line.starts_with("| `")) {  // behind the common options
      std::string name = line.substr(3, line.find('`', 3) - 3);
      std::replace(name.begin(), name.end(), '_', '-');  // TOML's spelling to the flag's
      EXPECT_THAT(help, HasSubstr("--" + name + " "));
      ++options;
    } else if (line.starts_with("- `") && line.find(".*`: [") != std::string::npos) {
      std::string prefix = line.substr(3, line.find(".*`") - 3);
      std::replace(prefix.begin(), prefix.end(), '_', '-');
      EXPECT_THAT(help, HasSubstr("--" + prefix + "."));
    }
  }
  EXPECT_GT(options, 4);
}

TEST_F(Program, OptionsDocument_IsUpToDate) {
  const ChildResult result = run({"options", "--markdown"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out,
            read_file_text(source_directory().string() + "/docs/reference/options.md", 1 << 20))
      << "run: atelier options --markdown > docs/reference/options.md";
}

TEST_F(Program, BashCompletion_CompletesCommandsAndFlags) {
  const std::string script = (root_ / "completion.bash").string();
  const ChildResult result = run({"completion", "bash"});
  ASSERT_EQ(result.exit_code, 0);
  std::ofstream(script) << result.out;
  const auto complete = [&](const std::string& words, int at) {
    const ChildResult shell = run_child({"bash", "-c",
                                         "source " + script + "; COMP_WORDS=(" + words +
                                             "); COMP_CWORD=" + std::to_string(at) +
                                             "; _atelier; echo \"${COMPREPLY[@]}\""});
    EXPECT_EQ(shell.exit_code, 0) << shell.err;
    EXPECT_THAT(shell.err, IsEmpty());
    return shell.out;
  };
  EXPECT_EQ(complete("atelier sta", 1), "statistics status\n");
  EXPECT_EQ(complete("atelier completion ba", 2), "bash\n");
  EXPECT_EQ(complete("atelier statistics --dry", 2), "--dry-run\n");
  EXPECT_EQ(complete("atelier statistics a b --statistics.e", 4), "--statistics.edge-quantiles\n");
  EXPECT_EQ(complete("atelier gc --j", 2), "--json\n");
  EXPECT_THAT(complete("atelier inspect " + (root_ / "compl").string(), 2), HasSubstr(script));
  EXPECT_EQ(complete("atelier nonsense --x", 2), "\n");
  // Values of options, in either spelling of the flag.
  EXPECT_EQ(complete("atelier statistics --device ''", 3), "cpu\n") << "all that it takes";
  EXPECT_EQ(complete("atelier statistics --device = cu", 4), "\n");
  EXPECT_EQ(complete("atelier convert a b --input.unit d", 5), "dm\n");
  EXPECT_EQ(complete("atelier body-model me", 2), "measure\n");
  if (run({"--help"}).out.find("\n  run ") != std::string::npos) {
    const std::string steps = complete("atelier run a b --from ''", 5);
    EXPECT_THAT(steps, AllOf(HasSubstr("validate"), Not(HasSubstr("statistics"))));
    std::istringstream words(steps);
    for (std::string step; words >> step;) {
      EXPECT_THAT(run({"run", "nothing", "work", "--from", step}).err, Not(HasSubstr("--from")));
    }
  }
  // Names, alone or beside files.
  for (const char* command : {"run", "simulate"}) {
    if (run({"--help"}).out.find("\n  " + std::string(command) + " ") != std::string::npos) {
      EXPECT_THAT(complete("atelier " + std::string(command) + " --material den", 3), "denim\n");
    }
  }
  const std::string help = run({"--help"}).out;
  for (const auto& [words, at, answer] :
       {std::tuple{"atelier simulate --body fem", 3, "female\n"},
        {"atelier animate --camera ''", 3, "front side back three-quarter orbit\n"},
        {"atelier synthesize --garment tee+t", 3, "tee+trousers\n"},
        {"atelier simulate --device ''", 3, "cpu cuda\n"},
        {"atelier simulate --device = cu", 4, "cuda\n"},
        {"atelier drape --body ma", 3, "male\n"},
        {"atelier animate --body ma", 3, "male\n"},
        {"atelier animate --motion stri", 3, "stride\n"},
        {"atelier personalize --body defa", 3, "default\n"},
        {"atelier synthesize --body rand", 3, "random\n"},
        {"atelier synthesize --motion aut", 3, "auto\n"},
        {"atelier synthesize --layout easy", 3, "easymocap\n"},
        {"atelier validate --layout easy", 3, "easymocap\n"},
        {"atelier validate --capture.layout easy", 3, "easymocap\n"},
        {"atelier convert-capture --layout easy", 3, "easymocap\n"},
        {"atelier evaluate --stage refi", 3, "refine\n"},
        {"atelier body-model show femal", 3, "female\n"}}) {
    std::istringstream command(words);
    std::string name;
    command >> name >> name;
    if (help.find("\n  " + name + " ") != std::string::npos) {  // a build may lack it
      EXPECT_EQ(complete(words, at), answer) << words;
    }
  }
  // Files of the kind that is taken, and folders, which may lead to some.
  for (const char* name : {"a.obj", "b.txt", "c.toml"}) {
    std::ofstream(root_ / name) << "x";
  }
  std::filesystem::create_directory(root_ / "folder");
  const std::string here = root_.path().string() + "/";
  EXPECT_EQ(complete("atelier convert " + here, 2), here + "folder " + here + "a.obj\n");
  EXPECT_EQ(complete("atelier convert a b --config " + here, 5),
            here + "folder " + here + "c.toml\n");
  EXPECT_THAT(complete("atelier inspect " + here, 2), HasSubstr(here + "b.txt"));
  if (run({"--help"}).out.find("\n  drape ") != std::string::npos) {
    std::ofstream(root_ / "p.json") << "x";
    EXPECT_THAT(complete("atelier drape --garment tro", 3), "trousers\n");
    EXPECT_EQ(complete("atelier drape --garment " + here, 3), here + "folder " + here + "p.json\n");
  }
  // Names with spaces are one word.
  std::filesystem::create_directory(root_ / "my capture");
  EXPECT_EQ(complete("atelier inspect " + here + "my", 2), here + "my capture\n");
  EXPECT_THAT(run_child({"bash", "-c",
                         "source " + script + "; COMP_WORDS=(atelier statistics " + here +
                             "my); COMP_CWORD=2; _atelier; echo ${#COMPREPLY[@]}"})
                  .out,
              StartsWith("1\n"));
  EXPECT_EQ(complete("atelier help stati", 2), "statistics\n");
  EXPECT_EQ(complete("atelier run a b --from stati", 5), "\n");
}

TEST_F(Program, Stages_AreListedInPipelineOrder) {
  const std::string help = run({"--help"}).out;
  std::size_t before = 0;
  for (const char* stage :
       {"validate", "reconstruct", "personalize", "track", "body", "template", "register",
        "flatten", "material", "simulate", "appearance", "avatar", "animate"}) {
    const std::size_t at = help.find("\n  " + std::string(stage) + " ");
    if (at != std::string::npos) {  // a build may lack it
      EXPECT_GT(at, before) << stage;
      before = at;
    }
  }
}

/// The stages and commands that the help lists.
std::vector<std::string> names_in(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ") && line[2] >= 'a' && line[2] <= 'z') {
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return names;
}

TEST_F(Program, EveryCommandWithoutArguments_SaysWhatItTakes) {
  const std::vector<std::string> names = names_in(run({"--help"}).out);
  EXPECT_GE(names.size(), 12U);
  for (const std::string& name : names) {
    if (name != "options") {  // which takes nothing
      SCOPED_TRACE(name);
      expect_refusal(run({name}), kExitUsage, name == "render-neural" ? "render --neural" : name);
    }
  }
}

/// The words that begin with "--" in front of a help's lines.
std::set<std::string> flags_in(const std::string& help) {
  std::set<std::string> flags;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos || begin == 0 || line[begin] != '-') {
      continue;
    }
    std::replace(line.begin(), line.end(), ',', ' ');  // "-h,--help"
    std::istringstream words(line);
    for (std::string word; words >> word && word.starts_with("-");) {
      if (word.starts_with("--")) {
        flags.insert(word);
      }
    }
  }
  return flags;
}

TEST_F(Program, Completion_KnowsEveryCommandAndFlag) {
  const std::string script = run({"completion", "bash"}).out;
  for (const std::string& name : names_in(run({"--help"}).out)) {
    EXPECT_THAT(script, ::testing::ContainsRegex("compgen -W '([a-z -]* )?" + name + " "));
    const std::size_t at = script.find("\n    " + name + ") words='");
    ASSERT_NE(at, std::string::npos) << name;
    const std::size_t begin = script.find('\'', at) + 1;
    std::istringstream words(script.substr(begin, script.find('\'', begin) - begin));
    std::set<std::string> completed;
    for (std::string word; words >> word;) {
      completed.insert(word);
    }
    EXPECT_EQ(completed, flags_in(run({name, "--help"}).out)) << name;
  }
}

TEST_F(Program, HelpSummaries_AreInOneColumn) {
  std::istringstream lines(run({"--help"}).out);
  std::set<std::size_t> columns;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ") && line[2] >= 'a' && line[2] <= 'z') {
      const std::size_t gap = line.find("  ", 2);
      ASSERT_NE(gap, std::string::npos) << line;
      columns.insert(line.find_first_not_of(' ', gap));
    }
  }
  EXPECT_EQ(columns.size(), 1U);
}

TEST_F(Program, CommandThatTheBuildLeavesOut_IsNamedAsSuch) {
  expect_refusal(run_child({small_program_path(), "masks"}), kExitUsage,
                 "this build of atelier leaves out the command 'masks'; cmake --preset release");
}

TEST_F(Program, FullStandardOutput_IsAnEnvironmentError) {
  const ChildResult result =
      run_child({"bash", "-c", small_program_path() + " --help > /dev/full"});
  EXPECT_EQ(result.exit_code, kExitEnvironment);
  EXPECT_THAT(result.err,
              HasSubstr("standard output: cannot write: No space left on device; free"));
}

TEST_F(Program, ClosedStandardStreams_AreNotReusedForFiles) {
  write_boxes(input(), 2);
  const std::string command = small_program_path() + " statistics " + input().string() + " ";
  const ChildResult silent =
      run_child({"bash", "-c", command + workspace().string() + " <&- 2>&-"});
  EXPECT_EQ(silent.exit_code, 0);
  EXPECT_THAT(silent.out, HasSubstr("statistics done: "));
  EXPECT_EQ(std::filesystem::file_size(stage_folder() / ".lock"), 0U);
  EXPECT_TRUE(is_clean());
  expect_refusal(run_child({"bash", "-c", small_program_path() + " --help >&-"}), kExitEnvironment,
                 "standard output: it is closed; ");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they need the address space
TEST_F(Program, FailedThreadCreation_IsAnEnvironmentError) {
  write_boxes(input(), 300);
  const ChildResult result =
      run_child({"bash", "-c",
                 "ulimit -v 600000; exec " + small_program_path() + " statistics " +
                     input().string() + " " + workspace().string() + " --jobs 1024 --json"});
  expect_refusal({result.exit_code, result.signal, "", result.err}, kExitEnvironment,
                 "use fewer --jobs");  // of threads, or of memory where a frame came first
}
#endif

TEST_F(Program, IgnoredInterrupt_StaysIgnored) {
  write_boxes(input(), 20);
  const ChildResult result =
      run_child({"bash", "-c",
                 "trap '' INT; " + small_program_path() + " statistics " + input().string() + " " +
                     workspace().string() + " & kill -INT $!; wait $!"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Program, TooLittleMemory_IsAnEnvironmentError) {
  write_boxes(input(), 1);
  // A mesh that needs a few hundred MB in an address space of less.
  std::ofstream(input() / "box_000.obj", std::ios::app)
      << std::string(300'000'000, '#');  // NOLINT(bugprone-string-constructor)
  const ChildResult result = run_child(
      {"bash", "-c",
       "ulimit -v 400000; exec " + small_program_path() + " statistics " + input().string() + " " +
           workspace().string() + " --jobs 1 --json"});  // progress is no error
  EXPECT_THAT(result.exit_code, ::testing::AnyOf(kExitEnvironment, kExitBadData)) << result.err;
  EXPECT_THAT(result.err, StartsWith("atelier: "));
}

}  // namespace
}  // namespace atelier::fixtures
