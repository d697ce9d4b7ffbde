// The dependency law (tests/build/dependency_law.h): the project keeps it, and each kind of
// violation is found when it is planted.
#include "tests/build/dependency_law.h"

#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

std::string quoted(const std::string& path) {
  return "#include \"" + path + "\"\n";
}

LawSource header(const std::string& path, const std::string& text = "") {
  return {path, "#pragma once\n\n" + text};
}

/// A small project that keeps the law, with what comes near to breaking it.
std::vector<LawSource> lawful_sources() {
  return {
      header("core/mesh.h"),
      header("core/io/file.h", quoted("core/mesh.h")),
      {"core/io/late/images.cpp", quoted("core/io/file.h") + "#include <opencv2/core.hpp>\n"},
      {"core/store/run.cpp", quoted("core/io/file.h")},
      {"core/render/draw.cpp", quoted("core/io/file.h")},
      header("capture/dataset.h", quoted("core/io/file.h")),
      {"capture/layouts/open.cpp", quoted("capture/dataset.h") + "#include <nlohmann/json.hpp>\n"},
      header("registration/solve.h", "// Private to registration.\n#include <ceres/problem.h>\n"),
      {"registration/solve.cpp", quoted("registration/solve.h")},
      header("simulation/xpbd/xpbd.h", quoted("core/mesh.h")),
      {"simulation/solver.cpp", quoted("simulation/xpbd/xpbd.h") + "#ifdef ATELIER_HAS_CUDA\n"},
      header("pipeline/precompiled.h", "#include <nlohmann/json.hpp>\n"),
      header("pipeline/row/row.h", "#include <nlohmann/json.hpp>\n"),
      {"pipeline/cloth/rows.cpp", quoted("pipeline/row/row.h") + quoted("capture/dataset.h")},
      header("apps/console/command.h", "#include <CLI/CLI.hpp>\n"),
      {"apps/console/commands.cpp",
       quoted("apps/console/command.h") + "#ifdef ATELIER_COMMAND_RUN\n#include <iostream>\n"},
      {"pipeline/cloth/cloth_rules.cpp", "rule(\"xpbd.drag\", \"more --xpbd.air-density\");\n"},
      {"apps/commands/run.cpp", quoted("apps/console/command.h") + quoted("pipeline/row/row.h")},
      {"tests/core/a_test.cpp", quoted("apps/console/command.h") + quoted("bench/speed.h")},
  };
}

/// What is found once some sources are added, or stand in for those of the same path.
std::vector<std::string> found_with(const std::vector<LawSource>& planted) {
  std::vector<LawSource> sources = lawful_sources();
  for (const LawSource& source : planted) {
    std::erase_if(sources, [&](const LawSource& other) { return other.path == source.path; });
    sources.push_back(source);
  }
  return law_violations(sources);
}

TEST(DependencyLaw, Project_KeepsIt) {
  const std::vector<LawSource> sources = read_law_sources(source_directory());
  std::map<std::string, int> files;
  for (const LawSource& source : sources) {
    ++files[source.path.substr(0, source.path.find('/'))];
  }
  for (const char* folder : {"core", "capture", "bodymodel", "registration", "simulation",
                             "appearance", "pipeline", "apps"}) {
    EXPECT_GE(files[folder], 10) << folder;
  }
  EXPECT_THAT(law_violations(sources), IsEmpty());
}

TEST(DependencyLaw, LawfulSources_AreAccepted) {
  EXPECT_THAT(law_violations(lawful_sources()), IsEmpty());
}

TEST(DependencyLaw, IncludeOfAHigherLevel_IsFound) {
  EXPECT_THAT(found_with({{"core/a.cpp", quoted("capture/dataset.h")}}),
              ElementsAre("core/a.cpp includes capture/dataset.h: core may not include capture"));
  EXPECT_THAT(found_with({{"capture/a.cpp", quoted("pipeline/row/row.h")}}),
              ElementsAre(HasSubstr("capture may not include pipeline")));
  EXPECT_THAT(found_with({{"pipeline/row/a.cpp", quoted("apps/console/command.h")}}),
              ElementsAre(HasSubstr("pipeline may not include apps")));
  EXPECT_THAT(found_with({{"simulation/a.cu", "#  include <pipeline/row/row.h>\n"}}),
              ElementsAre(HasSubstr("simulation may not include pipeline")));
}

TEST(DependencyLaw, IncludeOfASibling_IsFound) {
  EXPECT_THAT(found_with({{"simulation/a.cpp", quoted("registration/mesh.h")}}),
              ElementsAre(HasSubstr("simulation may not include registration")));
  EXPECT_THAT(found_with({{"bodymodel/human/a.h", "#pragma once\n" + quoted("capture/dataset.h")}}),
              ElementsAre(HasSubstr("bodymodel may not include capture")));
}

TEST(DependencyLaw, IncludeOfTestsAndTheLike_IsFound) {
  for (const std::string folder : {"tests", "bench", "examples", "fuzz"}) {
    for (const std::string file : {"core/a.cpp", "pipeline/row/a.cpp", "apps/commands/a.cpp"}) {
      EXPECT_THAT(found_with({{file, quoted(folder + "/support/a.h")}}),
                  ElementsAre(HasSubstr("may not include " + folder)));
    }
  }
}

TEST(DependencyLaw, ShortenedPath_IsFound) {
  for (const std::string file :
       {"core/a.cpp", "registration/a.cpp", "pipeline/row/a.cpp", "apps/console/a.cpp"}) {
    EXPECT_THAT(found_with({{file, quoted("command.h")}}),
                ElementsAre(file + " includes command.h: not by its full path"));
  }
}

TEST(DependencyLaw, CycleOfTwoRooms_IsFoundWithItsIncludes) {
  EXPECT_THAT(found_with({{"apps/console/a.cpp", quoted("apps/commands/run.h")},
                          {"apps/console/b.cpp", quoted("apps/commands/gc.h")}}),
              ElementsAre("rooms in a cycle, apps/commands -> apps/console -> apps/commands: "
                          "apps/commands/run.cpp includes apps/console/command.h; "
                          "apps/console/a.cpp includes apps/commands/run.h and 1 more"));
}

TEST(DependencyLaw, CycleThroughATopFolder_IsFound) {
  EXPECT_THAT(found_with({{"capture/a.cpp", quoted("capture/layouts/open.h")}}),
              ElementsAre(StartsWith("rooms in a cycle, capture -> capture/layouts -> capture: ")));
}

TEST(DependencyLaw, LongCycle_IsFoundOnce) {
  EXPECT_THAT(
      found_with({{"pipeline/a/a.cpp", quoted("pipeline/b/b.h") + quoted("pipeline/d/d.h")},
                  {"pipeline/b/b.cpp", quoted("pipeline/c/c.h")},
                  {"pipeline/c/c.cpp", quoted("pipeline/a/a.h") + quoted("pipeline/d/d.h")}}),
      ElementsAre(StartsWith(
          "rooms in a cycle, pipeline/a -> pipeline/b -> pipeline/c -> pipeline/a: "
          "pipeline/a/a.cpp includes pipeline/b/b.h; pipeline/b/b.cpp includes pipeline/c/c.h; ")));
}

TEST(DependencyLaw, EachOfTwoCycles_IsFound) {
  EXPECT_THAT(found_with({{"pipeline/a/a.cpp", quoted("pipeline/b/b.h")},
                          {"pipeline/b/b.cpp", quoted("pipeline/a/a.h") + quoted("pipeline/c/c.h")},
                          {"pipeline/c/c.cpp", quoted("pipeline/b/b.h")}}),
              UnorderedElementsAre(HasSubstr("pipeline/a -> pipeline/b -> pipeline/a"),
                                   HasSubstr("pipeline/b -> pipeline/c -> pipeline/b")));
}

TEST(DependencyLaw, LateFolder_CountsAsItsParent) {
  EXPECT_THAT(found_with({{"capture/a.cpp", quoted("capture/late/videos.h")}}), IsEmpty());
  EXPECT_THAT(found_with({{"capture/late/videos.cpp", quoted("capture/layouts/open.h")}}),
              ElementsAre(HasSubstr("capture -> capture/layouts -> capture")));
}

TEST(DependencyLaw, PartOfCoreOutOfOrder_IsFound) {
  const auto found = [](const std::string& file, const std::string& included) {
    return !law_violations({{file, quoted(included)}}).empty();
  };
  for (const std::string room : {"core/io", "core/remesh", "core/render", "core/store"}) {
    EXPECT_TRUE(found("core/a.cpp", room + "/a.h")) << room;
    EXPECT_FALSE(found(room + "/a.cpp", "core/a.h")) << room;
    EXPECT_FALSE(found(room + "/a.cpp", room + "/a.h")) << room;
    const bool above_io = room == "core/render" || room == "core/store";
    EXPECT_EQ(found(room + "/a.cpp", "core/io/a.h"), !above_io && room != "core/io") << room;
    EXPECT_EQ(found(room + "/a.cpp", "core/store/a.h"), room != "core/store") << room;
    EXPECT_EQ(found(room + "/a.cpp", "core/render/a.h"), room != "core/render") << room;
  }
  EXPECT_THAT(law_violations({{"core/io/late/a.cpp", quoted("core/render/a.h")}}),
              ElementsAre("core/io/late/a.cpp includes core/render/a.h: core/io may not use "
                          "core/render"));
}

TEST(DependencyLaw, CommandLineOrStreamsInPipeline_AreFound) {
  EXPECT_THAT(found_with({{"pipeline/row/a.cpp", "#include <CLI/CLI.hpp>\n"}}),
              ElementsAre(StartsWith("pipeline/row/a.cpp includes CLI/CLI.hpp: ")));
  EXPECT_THAT(found_with({{"pipeline/row/a.cpp", "#include <iostream>\n"}}),
              ElementsAre(StartsWith("pipeline/row/a.cpp includes iostream: ")));
}

TEST(DependencyLaw, HeavyPackageInAHeader_IsFound) {
  for (const std::string package : {"torch/torch.h", "CGAL/Surface_mesh.h", "opencv2/core.hpp",
                                    "spdlog/spdlog.h", "hdf5.h", "tbb/parallel_for.h"}) {
    EXPECT_THAT(
        found_with({header("pipeline/row/a.h", "#include <" + package + ">\n")}),
        ElementsAre("pipeline/row/a.h includes " + package + ": a heavy package in a header"));
  }
}

TEST(DependencyLaw, HeavyPackageThatPipelineParsesOnce_IsFoundInDomains) {
  EXPECT_THAT(found_with({header("core/io/a.h", "#include <nlohmann/json.hpp>\n")}),
              ElementsAre("core/io/a.h includes nlohmann/json.hpp: a heavy package in a header"));
}

TEST(DependencyLaw, PrivateHeaderUsedByAnotherFolder_IsFound) {
  EXPECT_THAT(found_with({{"registration/flattening/a.cpp", quoted("registration/solve.h")}}),
              ElementsAre("registration/flattening/a.cpp includes registration/solve.h: it is "
                          "private to registration"));
}

TEST(DependencyLaw, HeaderWithoutAGuard_IsFound) {
  EXPECT_THAT(found_with({{"core/a.h", "// Says what it does first.\n#pragma once\n"},
                          {"simulation/b.cuh", ""}}),
              UnorderedElementsAre(StartsWith("core/a.h: "), StartsWith("simulation/b.cuh: ")));
}

TEST(DependencyLaw, SolverNamedInAppsOrPipeline_IsFound) {
  EXPECT_THAT(found_with({{"pipeline/cloth/a.cpp", "// what Xpbd does\n"}}),
              ElementsAre("pipeline/cloth/a.cpp names a solver: // what Xpbd does"));
  EXPECT_THAT(found_with({{"apps/commands/a.cpp", quoted("simulation/xpbd/xpbd.h")}}),
              ElementsAre(StartsWith("apps/commands/a.cpp names a solver: ")));
  EXPECT_THAT(found_with({header("pipeline/cloth/run_xpbd.h")}),
              ElementsAre("pipeline/cloth/run_xpbd.h: its name has that of a solver"));
}

TEST(DependencyLaw, OptionOfASolver_IsNamedOnlyWhereOptionRulesAre) {
  EXPECT_THAT(found_with({{"pipeline/cloth/cloth_rules.cpp", "rule(\"xpbd.drag\", \"xpbd.\");\n"}}),
              IsEmpty());
  EXPECT_THAT(found_with({{"pipeline/cloth/a.cpp", "rule(\"xpbd.drag\");\n"}}),
              ElementsAre(StartsWith("pipeline/cloth/a.cpp names a solver: ")));
  EXPECT_THAT(found_with({{"pipeline/cloth/cloth_rules.cpp", "options.xpbd.drag = 0;\n"}}),
              ElementsAre(StartsWith("pipeline/cloth/cloth_rules.cpp names a solver: ")));
  EXPECT_THAT(found_with({{"pipeline/cloth/cloth_rules.cpp", quoted("simulation/xpbd/xpbd.h")}}),
              ElementsAre(StartsWith("pipeline/cloth/cloth_rules.cpp names a solver: ")));
}

TEST(DependencyLaw, BranchForAMissingPackage_IsFound) {
  for (const std::string line :
       {"#ifdef ATELIER_HAS_CAPTURE", "#ifndef ATELIER_HAS_CAPTURE", "#if ATELIER_HAS_CAPTURE",
        "# if defined(ATELIER_HAS_CAPTURE)", "#elif defined(ATELIER_HAS_CAPTURE)"}) {
    for (const std::string file : {"pipeline/cloth/a.cpp", "apps/console/commands.cpp"}) {
      EXPECT_THAT(found_with({{file, line + "\n"}}), ElementsAre(file + ": " + line));
    }
  }
  EXPECT_THAT(
      found_with({{"apps/commands/a.cpp",
                   "#if defined(_WIN32) && \\\n    defined(ATELIER_HAS_CAPTURE)\n"}}),
      ElementsAre(AllOf(StartsWith("apps/commands/a.cpp: #if"), HasSubstr("ATELIER_HAS_CAPTURE"))));
}

TEST(DependencyLaw, BranchForACommandOutsideItsTable_IsFound) {
  for (const std::string file : {"pipeline/chain/a.cpp", "apps/console/completion.cpp"}) {
    EXPECT_THAT(found_with({{file, "#ifdef ATELIER_COMMAND_RUN\n"}}),
                ElementsAre(file + ": #ifdef ATELIER_COMMAND_RUN"));
  }
}

TEST(DependencyLaw, StageThatWritesASequenceByItself_IsFound) {
  const std::string writes = "write_sequence(folder, frames);\n";
  EXPECT_THAT(found_with({{"pipeline/cloth/a.cpp", "void run_a(StageRun& run) {\n" + writes}}),
              ElementsAre(StartsWith("pipeline/cloth/a.cpp has a stage write a sequence")));
  EXPECT_THAT(found_with({{"pipeline/cloth/a.cpp", writes}}), IsEmpty());
}

TEST(DependencyLaw, MoreLinesThanAppsMayHave_AreFound) {
  const std::string most(9990, '\n');  // beside the few of the lawful sources
  EXPECT_THAT(found_with({{"apps/commands/a.cpp", most}}), IsEmpty());
  EXPECT_THAT(found_with({{"pipeline/row/a.cpp", most + most}}), IsEmpty());
  EXPECT_THAT(found_with({{"apps/commands/a.cpp", most}, {"apps/appearance/b.cpp", "\n\n\n"}}),
              ElementsAre("apps has 10001 lines of at most 10000: what computes, reads or writes "
                          "belongs in a room of pipeline or in a domain"));
}

}  // namespace
}  // namespace atelier::fixtures
