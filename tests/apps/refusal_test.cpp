// What is refused on the command line: one readable line and the documented exit code.

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/exit_code.h"
#include "tests/apps/program_fixture.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

// --- refusals of the command line

struct BadCommand {
  const char* name;
  std::vector<std::string> arguments;
  int code;
  const char* words;
};

void PrintTo(const BadCommand& bad, std::ostream* out) {
  *out << bad.name;
}

class Refused : public Program, public ::testing::WithParamInterface<BadCommand> {};

INSTANTIATE_TEST_SUITE_P(
    All, Refused,
    ::testing::Values(
        BadCommand{"UnknownCommand", {"statistcs"}, 2, "did you mean 'statistics'?"},
        BadCommand{"UnknownCommandFarAway", {"qqqqq"}, 2, "there is no command 'qqqqq'; see"},
        BadCommand{"MisspeltMaterial",
                   {"simulate", "--garment", "tee", "--material", "coton", "--out", "none"},
                   2,
                   "did you mean 'cotton'?"},
        BadCommand{"DraftedGarment",
                   {"simulate", "--garment", "te", "--out", "none"},
                   3,
                   "drape --garment tee"},
        BadCommand{"FlagInsteadOfCommand",
                   {"--workspace"},
                   2,
                   "there is no option '--workspace' before the command; see"},
        BadCommand{"EmptyCommand", {""}, 2, "there is no command ''"},
        BadCommand{"NoInput", {"statistics"}, 2, "statistics takes INPUT and WORKSPACE"},
        BadCommand{"NoWorkspace", {"statistics", "IN"}, 2, "statistics takes INPUT and WORKSPACE"},
        BadCommand{"EmptyInput", {"statistics", "", "WS"}, 2, "INPUT: it cannot be ''"},
        BadCommand{"EmptyWorkspace", {"statistics", "IN", ""}, 2, "WORKSPACE: it cannot be ''"},
        BadCommand{"FramesTwice",
                   {"statistics", "IN", "WS", "--frames", "1", "--frames", "2"},
                   2,
                   "--frames is given twice"},
        BadCommand{"FramesTwiceByEquals",
                   {"statistics", "IN", "WS", "--frames=1", "--frames=2"},
                   2,
                   "--frames is given twice"},
        BadCommand{"OptionTwice",
                   {"statistics", "IN", "WS", "--input.unit", "m", "--input.unit", "cm"},
                   2,
                   "--input.unit is given twice"},
        BadCommand{"OptionTwiceInTwoSpellings",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "0.5",
                    "--statistics.edge-quantiles=0.1"},
                   2,
                   "--statistics.edge-quantiles is given twice"},
        BadCommand{"NothingBehindEquals",
                   {"statistics", "IN", "WS", "--frames="},
                   2,
                   "--frames cannot be ''"},
        BadCommand{"FlagWithAWord",
                   {"statistics", "IN", "WS", "--dry-run=maybe"},
                   2,
                   "--dry-run cannot be 'maybe': it takes true or false, or nothing"},
        BadCommand{"SwitchWithAWordBehindIt",
                   {"reconstruct", "IN", "WS", "--label-by-color", "maybe"},
                   2,
                   "--label-by-color cannot be 'maybe': it takes true or false, or nothing"},
        BadCommand{"FlagWithAWordBehindIt",
                   {"statistics", "IN", "WS", "--force", "maybe"},
                   2,
                   "--force cannot be 'maybe': it takes true or false, or nothing"},
        BadCommand{"FlagWithTwoWords",
                   {"statistics", "IN", "WS", "--force", "true", "true"},
                   2,
                   "does not take 'true' as well"},
        BadCommand{"FlagInCapitals",
                   {"status", "WS", "--JSON"},
                   2,
                   "no option '--JSON', did you mean '--json'?"},
        BadCommand{"ChoiceInCapitals",
                   {"statistics", "IN", "WS", "--input.unit", "MM"},
                   2,
                   "did you mean 'mm'?"},
        BadCommand{"DeviceInCapitals",
                   {"statistics", "IN", "WS", "--device", "CUDA"},
                   2,
                   "did you mean 'cuda'?"},
        BadCommand{"CommandInCapitals", {"STATUS", "WS"}, 2, "did you mean 'status'?"},
        BadCommand{"OneTooMany", {"statistics", "IN", "WS", "x"}, 2, "does not take 'x' as well"},
        BadCommand{
            "UnknownFlag",
            {"statistics", "IN", "WS", "--forse"},
            2,
            "has no option '--forse', did you mean '--force'? See atelier statistics --help"},
        BadCommand{"OptionOfEitherSolver",
                   {"simulate", "--solver", "xpbd", "--substeps", "4"},
                   2,
                   "did you mean '--xpbd.substeps'?"},
        BadCommand{"OptionOfTheOtherSolver",
                   {"simulate", "--solver", "projective-friction", "--substeps", "4"},
                   2,
                   "did you mean '--projective-friction.substeps'?"},
        BadCommand{
            "OptionOfTheOtherSolverInASection",
            {"animate", "IN", "WS", "--cloth.solver", "projective-friction", "--substeps", "4"},
            2,
            "did you mean '--cloth.projective-friction.substeps'?"},
        BadCommand{"AnOptionBehindDashes",
                   {"statistics", "IN", "WS", "--", "--force"},
                   2,
                   "takes no '--force' behind '--'"},
        BadCommand{"ACommandAsAFlag",
                   {"statistics", "IN", "WS", "--status=x"},
                   2,
                   "no option '--status=x': status is a command of its own; see atelier status "
                   "--help"},
        BadCommand{"FramesOfAStageThatTakesAll",
                   {"flatten", "IN", "WS", "--shard", "0/2"},
                   2,
                   "no option '--shard': it works on all frames together"},
        BadCommand{"UnknownOption",
                   {"statistics", "IN", "WS", "--statistics.edge_quantile", "1"},
                   2,
                   "did you mean '--statistics.edge-quantiles'?"},
        BadCommand{"UnknownOptionWithEquals",
                   {"statistics", "IN", "WS", "--input.units=m"},
                   2,
                   "did you mean '--input.unit'?"},
        BadCommand{"OptionOutOfRange",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "2"},
                   2,
                   "it takes a list of numbers in [0, 1]"},
        BadCommand{"OptionNotANumber",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "half"},
                   2,
                   "--statistics.edge_quantiles cannot be 'half'"},
        BadCommand{"OptionNaN",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "nan"},
                   2,
                   "cannot be 'nan'"},
        BadCommand{"UnknownChoice",
                   {"statistics", "IN", "WS", "--input.unit", "km"},
                   2,
                   "input.unit cannot be 'km': it takes m, dm, cm, mm, in, ft"},
        BadCommand{
            "OptionWithoutValue", {"statistics", "IN", "WS", "--input.unit"}, 2, "--input.unit"},
        BadCommand{"BadJobs", {"statistics", "IN", "WS", "--jobs", "-1"}, 2, "--jobs"},
        BadCommand{"JobsNoNumber", {"statistics", "IN", "WS", "--jobs", "many"}, 2, "--jobs"},
        BadCommand{"TooManyJobs", {"statistics", "IN", "WS", "--jobs", "1000000"}, 2, "--jobs"},
        BadCommand{"BadDevice", {"statistics", "IN", "WS", "--device", "tpu"}, 2, "--device"},
        BadCommand{"JobsNoWholeNumber",
                   {"statistics", "IN", "WS", "--jobs", "1.5"},
                   2,
                   "'1.5' is no whole number"},
        BadCommand{"CudaWithoutTwin",
                   {"statistics", "IN", "WS", "--device", "cuda"},
                   2,
                   "works on the processor alone"},
        BadCommand{
            "LongName", {"statistics", std::string(300, 'n'), "WS"}, 5, "File name too long"},
        BadCommand{
            "LongWorkspace", {"statistics", "IN", std::string(300, 'w')}, 5, "File name too long"},
        BadCommand{"LoopOfLinks", {"statistics", "loop", "WS"}, 3, "not a regular file"},
        BadCommand{"InspectALoop", {"inspect", "loop"}, 3, "not a regular file"},
        BadCommand{"InspectAPipe", {"inspect", "pipe.obj"}, 3, "not a regular file"},
        BadCommand{"InspectADevice", {"inspect", "/dev/null"}, 3, "not a regular file"},
        BadCommand{"ConvertAPipe", {"convert", "pipe.obj", "x.ply"}, 3, "not a regular file"},
        BadCommand{"ConvertALoop", {"convert", "loop.obj", "x.ply"}, 3, "not a regular file"},
        BadCommand{"ConvertADevice", {"convert", "null.obj", "x.ply"}, 3, "not a regular file"},
        BadCommand{"StatisticsOfAPipe", {"statistics", "pipe.obj", "WS"}, 3, "not a regular file"},
        BadCommand{"StatusOfALongName", {"status", std::string(300, 'w')}, 5, "File name too long"},
        BadCommand{"GcOfALoop", {"gc", "loop"}, 3, "no folder"},
        BadCommand{"StatusOfNoWorkspace", {"status", "IN"}, 3, "no stage has run"},
        BadCommand{"ConvertAFolder", {"convert", "IN", "x.ply"}, 3, "a folder"},
        BadCommand{"TerminalEscape", {"no\x1b[31m"}, 2, "'no?[31m'"},
        BadCommand{"TextTurnedRound", {"no\u202e"}, 2, "'no?\?\?'"},
        BadCommand{"BadFrames",
                   {"statistics", "IN", "WS", "--frames", "5:3"},
                   2,
                   "--frames cannot be '5:3': it takes a:b, a:, :b or a,"},
        BadCommand{
            "BadShard", {"statistics", "IN", "WS", "--shard", "2/2"}, 2, "--shard cannot be '2/2'"},
        BadCommand{"FramesOfNothing",
                   {"statistics", "IN", "WS", "--frames", "500"},
                   2,
                   "boxes it takes a range that holds frame 0, the only one"},
        BadCommand{"FramesBeyondTheLast",
                   {"statistics", "IN", "WS", "--frames", "7:"},
                   2,
                   "--frames cannot be '7:': of "},
        BadCommand{"MissingConfig",
                   {"statistics", "IN", "WS", "--config", "nothing.toml"},
                   2,
                   "--config nothing.toml: No such file or directory"},
        BadCommand{"MalformedConfig",
                   {"statistics", "IN", "WS", "--config", "IN/box_000.obj"},
                   2,
                   "box_000.obj"},
        BadCommand{"CorrectionWithoutACamera",
                   {"validate", "IN", "--capture.sync", "x"},
                   2,
                   "sync cannot be 'x': it takes CAMERA=VALUE,CAMERA=VALUE"},
        BadCommand{"CorrectionOfNoValue",
                   {"convert-capture", "IN", "new", "--extrinsics", "00=foo"},
                   2,
                   "extrinsics cannot be 'foo': it takes inverse"},
        BadCommand{"CorrectionInAFile",
                   {"reconstruct", "IN", "WS", "--config", "sync.toml"},
                   2,
                   "sync.toml:2: capture.masks cannot be 'foo': it takes inverted"},
        BadCommand{"RenderNothing",
                   {"render", "nosuch", "--out", "x.png"},
                   3,
                   "nosuch: nothing there; expected a mesh file"},
        BadCommand{"MissingInput", {"statistics", "nothing", "WS"}, 3, "nothing there"},
        BadCommand{"WorkspaceInInput",
                   {"statistics", "IN", "IN/work"},
                   2,
                   "a workspace inside its own input"},
        BadCommand{"WorkspaceIsAFolderOfOtherThings",
                   {"statistics", "IN", "IN/../capture"},
                   2,
                   "WORKSPACE cannot be 'boxes/../capture': it holds capture.toml and images, and "
                   "no stage's results; name a new or an empty folder"},
        BadCommand{"WorkspaceUpFromAFolderThatIsNotThere",
                   {"statistics", "IN", "new/.."},
                   2,
                   "WORKSPACE cannot be '.': it holds bare, boxes and"},
        BadCommand{"WorkspaceOfACaptureUpFromAFolderThatIsNotThere",
                   {"statistics", "IN", "capture/new/a/../.."},
                   2,
                   "it holds capture.toml and images, and no stage's results"},
        BadCommand{"WorkspaceIsALinkToNothing",
                   {"statistics", "IN", "nowhere"},
                   5,
                   "WORKSPACE nowhere: a broken symbolic link; create the folder"},
        BadCommand{"ForceTwice",
                   {"statistics", "IN", "WS", "--force", "--force"},
                   2,
                   "--force is given twice"},
        BadCommand{"RenderWithoutFaces",
                   {"render", "point.obj", "--out", "x.png"},
                   3,
                   "point.obj: no faces; expected a triangle mesh"},
        BadCommand{"WorkspaceIsAFile",
                   {"statistics", "IN", "IN/../file"},
                   2,
                   "WORKSPACE cannot be 'boxes/../file': not a folder; name a folder"},
        BadCommand{"WorkspaceBelowAFile",
                   {"statistics", "IN", "file/x"},
                   5,
                   "a file lies where a folder is expected"},
        BadCommand{"WorkspaceInProc", {"statistics", "IN", "/proc/atelier"}, 5, "/proc"},
        BadCommand{"DryRunOfAWorkspaceInProc",
                   {"statistics", "IN", "/proc/atelier", "--dry-run"},
                   5,
                   "/proc"},
        BadCommand{
            "DryRunOfACaptureInProc", {"synthesize", "/proc/atelier", "--dry-run"}, 5, "/proc"},
        BadCommand{"StatusOfNothing", {"status"}, 2, " takes a WORKSPACE"},
        BadCommand{"StatusMissing", {"status", "nothing"}, 3, "no folder"},
        BadCommand{
            "StatusUnknownFlag", {"status", "WS", "--digest"}, 2, "did you mean '--digests'?"},
        BadCommand{"InspectNothing", {"inspect"}, 2, "inspect takes a FILE"},
        BadCommand{"InspectMissing", {"inspect", "nothing.obj"}, 3, "nothing there"},
        BadCommand{"InspectABareFolder", {"inspect", "bare"}, 3, "a folder of none of these"},
        BadCommand{"InspectNoToml", {"inspect", "no.toml"}, 3, "no.toml"},
        BadCommand{"InspectNoForeignHdf5", {"inspect", "half.h5"}, 3, "half.h5"},
        BadCommand{"InspectNoGltf", {"inspect", "no.glb"}, 3, "no.glb"},
        BadCommand{
            "InspectUnknownKind", {"inspect", "file"}, 3, "a kind of file that is not known"},
        BadCommand{"InspectNoImage", {"inspect", "no.png"}, 3, "no.png"},
        BadCommand{"InspectNoJson", {"inspect", "no.json"}, 3, "no.json"},
        BadCommand{"InspectNoArchive", {"inspect", "no.h5"}, 3, "no HDF5 file"},
        BadCommand{"InspectNoMesh", {"inspect", "no.ply"}, 3, "no.ply"},
        BadCommand{"InspectNoNpz", {"inspect", "no.npz"}, 3, "no.npz"},
        BadCommand{"GcOfNothing", {"gc"}, 2, " takes a WORKSPACE"},
        BadCommand{"GcOfNoWorkspace", {"gc", "IN"}, 3, "no stage has run"},
        BadCommand{"GcMissing", {"gc", "nothing"}, 3, "no folder"},
        BadCommand{"ConvertNothing", {"convert"}, 2, "convert takes two files"},
        BadCommand{"ConvertToUnknown",
                   {"convert", "IN/box_000.obj", "x.fbx"},
                   2,
                   "it takes a name with .obj, .ply or .glb"},
        BadCommand{"ConvertOntoItself",
                   {"convert", "IN/box_000.obj", "IN/../boxes/box_000.obj"},
                   2,
                   "it is IN itself"},
        BadCommand{"ConvertOntoItselfByALink",
                   {"convert", "IN/box_000.obj", "same.obj"},
                   2,
                   "it is IN itself"},
        BadCommand{"ConvertMissing", {"convert", "nothing.obj", "x.ply"}, 3, "nothing.obj"},
        BadCommand{"ConvertBadUnit",
                   {"convert", "a.obj", "b.obj", "--input.unit", "km"},
                   2,
                   "input.unit cannot be 'km'"},
        BadCommand{
            "ConvertIntoNothing", {"convert", "IN/box_000.obj", "no/where/x.ply"}, 5, "no/where"},
        BadCommand{"ConvertIntoNoFolder",
                   {"convert", "IN/box_000.obj", "nodir/x.obj"},
                   5,
                   "create it first"},
        BadCommand{"RenderIntoNoFolder",
                   {"render", "nothing.obj", "--out", "nodir/x.png"},
                   5,
                   "create it first"},
        BadCommand{"DrapeIntoAFile",
                   {"drape", "--out", "file/x"},
                   5,
                   "a file lies where a folder is expected"},
        BadCommand{"DrapeUpFromAFolderThatIsNotThere",
                   {"drape", "--out", "new/.."},
                   2,
                   "new/.. already exists, and no flag replaces it"},
        BadCommand{"SynthesizeUpFromAFolderThatIsNotThere",
                   {"synthesize", "new/.."},
                   2,
                   "OUT cannot be '.': it holds other things"},
        BadCommand{"SynthesizeIntoACaptureUpFromAFolderThatIsNotThere",
                   {"synthesize", "capture/new/a/../.."},
                   2,
                   "it holds other things"},
        BadCommand{"ShowIntoNoFolder",
                   {"body-model", "show", "default", "--out", "nodir/x.png"},
                   5,
                   "create it first"},
        BadCommand{
            "RenderTooManyPixels",
            {"render", "nothing.obj", "--out", "x.png", "--width", "16384", "--height", "16384"},
            2,
            "268435456 pixels: at most 64000000"},
        BadCommand{"ShowTooManyPixels",
                   {"body-model", "show", "default", "--out", "x.png", "--width", "6000",
                    "--height", "6000"},
                   2,
                   "144000000 pixels: at most 64000000"},
        BadCommand{"EmptyList",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", ""},
                   2,
                   "--statistics.edge_quantiles cannot be ''"},
        BadCommand{"OptionBeforeTheCommand",
                   {"--JSON", "status", "WS"},
                   2,
                   "before the command, did you mean 'atelier status --json'?"},
        BadCommand{"TypoOfHelp", {"--hlep"}, 2, "did you mean '--help'?"},
        BadCommand{"LineEndInACommand", {"in\nspect"}, 2, "'in spect', did you mean 'inspect'?"},
        BadCommand{"VersionAndMore", {"--version", "x"}, 2, "--version takes nothing more"},
        BadCommand{"HelpAndMore", {"-h", "status"}, 2, "-h takes nothing more, not 'status'"},
        BadCommand{"HelpOfTwo", {"help", "gc", "x"}, 2, "help takes nothing more, not 'x'"},
        BadCommand{"HelpOfNoCommand", {"help", "insepct"}, 2, "did you mean 'inspect'?"},
        BadCommand{
            "NoFrames", {"statistics", "IN", "WS", "--frames", ""}, 2, "--frames cannot be ''"},
        BadCommand{"NegativeFrames",
                   {"statistics", "IN", "WS", "--frames", "-1:5"},
                   2,
                   "--frames cannot be '-1:5'"},
        BadCommand{"NoShard", {"statistics", "IN", "WS", "--shard", ""}, 2, "--shard cannot be ''"},
        BadCommand{"NegativeJobs",
                   {"statistics", "IN", "WS", "--jobs", "-3"},
                   2,
                   "'-3' is no whole number from 0 to 1024"},
        BadCommand{
            "NoConfig", {"statistics", "IN", "WS", "--config", ""}, 2, "--config cannot be ''"},
        BadCommand{
            "ConfigOfAFolder", {"statistics", "IN", "WS", "--config", "IN"}, 2, "boxes: a folder"},
        BadCommand{
            "ADashAlone", {"inspect", "--", "-nothing.obj"}, 3, "-nothing.obj: nothing there"},
        BadCommand{"CompletionOfAnotherShell", {"completion", "fish"}, 2, "of which there is bash"},
        BadCommand{"OptionsWithArgument", {"options", "x"}, 2, "does not take 'x'; see"}),
    [](const ::testing::TestParamInfo<BadCommand>& bad) { return bad.param.name; });

TEST_P(Refused, BadCall_GivesOneLineAndItsExitCode) {
  write_boxes(input(), 1);
  std::ofstream(root_ / "file") << "x";
  std::filesystem::create_symlink("loop", root_ / "loop");
  std::filesystem::create_symlink("gone", root_ / "nowhere");
  std::ofstream(root_ / "point.obj") << "v 0 0 0\n";
  std::filesystem::create_symlink("loop.obj", root_ / "loop.obj");
  std::filesystem::create_symlink("/dev/null", root_ / "null.obj");
  std::filesystem::create_symlink("boxes/box_000.obj", root_ / "same.obj");
  ASSERT_EQ(mkfifo((root_ / "pipe.obj").c_str(), 0600), 0);
  std::filesystem::create_directory(root_ / "bare");
  std::ofstream(root_ / "sync.toml") << "capture.sync = \"00=1\"\ncapture.masks = \"all=foo\"\n";
  std::filesystem::create_directories(root_ / "capture" / "images");
  std::ofstream(root_ / "capture" / "capture.toml") << "";
  std::ofstream(root_ / "half.h5") << "\x89HDF\r\n\x1a\n and no more";
  for (const char* name : {"no.png", "no.json", "no.h5", "no.ply", "no.npz", "no.toml", "no.glb"}) {
    std::ofstream(root_ / name) << "this is something else";
  }
  std::vector<std::string> arguments = GetParam().arguments;
  std::string command =
      "cd " + root_.path().string() + " && exec " +
      (arguments.empty() || arguments[0] == "statistics" || arguments[0] == "status"
           ? small_program_path()
           : program_path());
  for (std::string& argument : arguments) {
    if (argument.starts_with("IN")) {
      argument.replace(0, 2, "boxes");
    } else if (argument == "WS") {
      argument = "work";
    }
    command += " '" + argument + "'";
  }
  expect_refusal(run_child({"bash", "-c", command}), GetParam().code, GetParam().words);
  EXPECT_FALSE(std::filesystem::exists(workspace())) << "it leaves nothing";
  EXPECT_FALSE(std::filesystem::exists(root_ / "new")) << "nor a folder on the way";
}

// Files that cannot be used: one line with the file, code 3, no result.

struct BadInput {
  const char* name;
  const char* file;
  const char* text;
  const char* words;
};

void PrintTo(const BadInput& bad, std::ostream* out) {
  *out << bad.name;
}

class BadMeshes : public Program, public ::testing::WithParamInterface<BadInput> {};

INSTANTIATE_TEST_SUITE_P(
    All, BadMeshes,
    ::testing::Values(
        BadInput{"NaN", "box_001.obj", "v nan 0 0\n", "box_001.obj"},
        BadInput{"Infinity", "box_001.obj", "v inf 0 0\n", "box_001.obj"},
        BadInput{"IndexOutOfRange", "box_001.obj", "v 0 0 0\nf 1 2 3\n", "box_001.obj"},
        BadInput{"NoNumber", "box.obj", "v 0 0 0\n", "no frame number at its end"},
        BadInput{"SameNumber", "shape_0.obj", "v 0 0 0\n", "one file for each frame"},
        BadInput{"HugeNumber", "box_99999999999.obj", "v 0 0 0\n", "no frame number at its end"},
        BadInput{"NoPly", "box_001.ply", "hello", "box_001.ply"},
        BadInput{"NoToml", "capture.toml", "[consent", "capture.toml"},
        BadInput{"BadConsent", "capture.toml", "consent = 1", "capture.toml"},
        BadInput{"ConsentOfAnotherType", "capture.toml", "[consent]\nwho = 3\n",
                 "line 2, consent.who: a number; expected a string"},
        BadInput{"ConsentOfAnotherField", "capture.toml", "[consent]\nwhom = 3\n",
                 "consent.whom: a field that consent does not have; expected who, scope and until"},
        BadInput{"ConsentMisspelt", "consent.toml", "[consents]\nwho = 'P'\nscope = 'a'\n",
                 "'consents.who', but no table [[consent]]"},
        BadInput{"ConsentWithoutItsTable", "consent.toml", "who = 'P'\nscope = 'a'\n",
                 "'who', but no table [[consent]]"}),
    [](const ::testing::TestParamInfo<BadInput>& bad) { return bad.param.name; });

TEST_P(BadMeshes, BadMesh_IsRefusedByName) {
  write_boxes(input(), 1);
  std::ofstream(input() / GetParam().file) << GetParam().text;
  const ChildResult result = run_statistics({"--jobs", "1"});
  EXPECT_EQ(result.exit_code, kExitBadData) << result.err;
  EXPECT_THAT(result.err, HasSubstr("atelier: "));
  EXPECT_THAT(result.err, HasSubstr(GetParam().words));
  EXPECT_FALSE(std::filesystem::exists(stage_folder() / "current"));
}

using BadFiles = Program;

TEST_F(BadFiles, UnprintableNames_AreRefusedBeforeAnyWork) {
  write_boxes(input(), 1);
  const auto refused = [&](const std::string& in, const std::string& out,
                           std::vector<std::string> more, const std::string& words) {
    more.insert(more.begin(), {small_program_path(), "statistics", in, out});
    expect_refusal(run_child(more), kExitUsage, words);
    EXPECT_FALSE(std::filesystem::exists(out));
  };
  const std::string in = input().string();
  const std::string out = workspace().string();
  for (const char* name : {"caf\xe9", "bo\txes", "bo\nxes", "bo\u202exes"}) {
    const std::string bad = (root_ / name).string();
    write_boxes(bad, 1);
    std::ofstream(bad + ".toml") << "[input]\nunit = 'm'\n";
    std::filesystem::create_directory_symlink(bad, root_ / "link");
    refused(bad, out, {}, "INPUT cannot be");
    refused((root_ / "link").string(), out, {"--json"}, "not printable UTF-8");
    refused(in, bad + "_work", {"--json"}, "WORKSPACE cannot be");
    refused(in, out, {"--config", bad + ".toml"}, "--config cannot be");
    std::filesystem::remove(root_ / "link");
  }
}

TEST_F(BadFiles, BadInput_LeavesNoWorkspace) {
  std::filesystem::create_directories(input());
  std::ofstream(input() / "box_000.obj") << "";
  EXPECT_EQ(run_statistics({}).exit_code, kExitBadData);
  EXPECT_FALSE(std::filesystem::exists(workspace()));
}

TEST_F(BadFiles, OptionsFileMistakes_GetALineEach) {
  write_boxes(input(), 1);
  std::ofstream(root_ / "bad.toml") << "[input]\nunit = 'km'\nupp = 'y'\n";
  const ChildResult result = run_statistics({"--config", (root_ / "bad.toml").string()});
  EXPECT_EQ(result.exit_code, kExitUsage);
  std::istringstream lines(result.err);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_THAT(line, ::testing::StartsWith("atelier: "));
  }
  EXPECT_EQ(count, 2) << result.err;
}

}  // namespace
}  // namespace atelier::fixtures
