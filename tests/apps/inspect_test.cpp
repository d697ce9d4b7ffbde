// `inspect`: what a file is.

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "pipeline/inspection/inspection.h"
#ifdef ATELIER_HAS_CORE_RENDER
#include "core/render/video.h"
#endif
#include "tests/apps/program_fixture.h"
#ifdef ATELIER_HAS_BODYMODEL
#include "tests/bodymodel/c3d_writer.h"
#include "tests/bodymodel/synthetic_markers.h"
#endif
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

using Inspect = Program;

TEST_F(Inspect, File_IsDescribedByKindAndFacts) {
  write_boxes(input(), 1);
  const ChildResult mesh = run({"inspect", (input() / "box_000.obj").string()});
  EXPECT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_THAT(mesh.out, AllOf(HasSubstr("vertices          8"), HasSubstr("1 m3")));
  run_statistics({});
  const ChildResult manifest =
      run({"inspect", (stage_folder() / "current/manifest.json").string()});
  EXPECT_THAT(manifest.out, HasSubstr("manifest of a result of 'statistics'"));
  const auto json =
      nlohmann::json::parse(run({"inspect", (input() / "box_000.obj").string(), "--json"}).out);
  EXPECT_EQ(json["vertices"], 8);
  EXPECT_EQ(json["area"], 6.0);
  EXPECT_EQ(json["units"]["area"], "m2");
  EXPECT_EQ(json["highest"], nlohmann::json({1.0, 1.0, 1.0}));
}

TEST_F(Inspect, MeshWithoutMostFaces_IsPossiblyTruncated) {
  const std::filesystem::path file = root_ / "torn.obj";
  std::ofstream(file) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 2 2 0\nv 3 1 0\nf 1 2 3\n";
  const ChildResult torn = run({"inspect", file.string()});
  EXPECT_THAT(torn.out, HasSubstr("4 of 7 vertices are in no face: the file is possibly cut off"));
  std::ofstream(file, std::ios::app) << "f 2 4 3\n";
  EXPECT_THAT(run({"inspect", file.string()}).out, Not(HasSubstr("cut off")));
  std::ofstream(file) << "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_THAT(run({"inspect", file.string()}).out, HasSubstr("3 of 3 vertices are in no face"));
}

TEST_F(Inspect, Tensors_AreShownWithoutControlCharacters) {
  const std::vector<float> values = {1, -2.5f, 3, std::nanf("")};
  Safetensors content;
  content.tensors["weights\x1b[31m"] = tensor_of(values, {2, 2});
  write_safetensors(root_ / "net.safetensors", content);
  write_npz(root_ / "data.npz", {{"weights", tensor_of(values, {2, 2})}});
  const ChildResult net = run({"inspect", (root_ / "net.safetensors").string()});
  EXPECT_EQ(net.exit_code, 0) << net.err;
  EXPECT_THAT(net.out, HasSubstr("weights?[31m"));
  EXPECT_THAT(net.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(net.out, HasSubstr("float32 [2,2], -2.5 to 3, 1 not finite"));
  EXPECT_THAT(run({"inspect", (root_ / "data.npz").string()}).out,
              HasSubstr("float32 [2,2], -2.5 to 3, 1 not finite"));
  const auto json =
      nlohmann::json::parse(run({"inspect", (root_ / "data.npz").string(), "--json"}).out);
  EXPECT_EQ(json["findings"][0]["code"], "not-finite");
  EXPECT_THAT(json["findings"][0]["advice"].get<std::string>(),
              HasSubstr("the program that wrote it"));
}

TEST_F(Inspect, MemberNames_DoNotOverwriteFacts) {
  const std::vector<float> values = {1, 2};
  write_npz(root_ / "data.npz",
            {{"kind", tensor_of(values, {2})}, {"file", tensor_of(values, {2})}});
  const auto json =
      nlohmann::json::parse(run({"inspect", (root_ / "data.npz").string(), "--json"}).out);
  EXPECT_EQ(json["kind"], "npz");
  EXPECT_EQ(json["arrays"], 2);
  EXPECT_EQ(json["members"]["kind"]["shape"], nlohmann::json({2}));
  EXPECT_EQ(json["members"]["file"]["most"], 2.0);
}

TEST_F(Inspect, ForeignHdf5_IsShownByAWorkerProcess) {
  const std::filesystem::path corpus = source_directory() / "fuzz/corpus/foreign_hdf5";
  int shown = 0;
  for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
    const std::filesystem::path copy = root_ / "foreign.h5";
    std::filesystem::copy_file(entry.path(), copy,
                               std::filesystem::copy_options::overwrite_existing);
    const ChildResult result = run({"inspect", copy.string(), "--json"});
    if (result.exit_code == 0) {
      const auto json = nlohmann::json::parse(result.out);
      EXPECT_EQ(json["kind"], "HDF5 of another program");
      EXPECT_TRUE(json["datasets"].is_number());
      ++shown;
    } else {
      EXPECT_EQ(result.exit_code, kExitBadData) << result.err;
    }
  }
  EXPECT_GT(shown, 0);
}

TEST_F(Inspect, GltfSkinsAnimationsAndMorphTargets_AreShown) {
  GltfScene scene;
  Mesh mesh;
  mesh.vertices = Points::Random(3, 3);
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  scene = gltf_scene(mesh, "cape");
  scene.meshes[0].primitives[0].targets = {{Points::Ones(3, 3), Points(0, 3)}};
  scene.meshes[0].target_names = {"billow"};
  GltfChannel channel;
  channel.node = 0;
  channel.path = GltfPath::Translation;
  channel.times = {0, 1.5};
  channel.values = Eigen::MatrixXd::Zero(2, 3);
  scene.animations.push_back({"sway", {channel}});
  write_gltf(root_ / "cape.glb", scene);
  const auto json =
      nlohmann::json::parse(run({"inspect", (root_ / "cape.glb").string(), "--json"}).out);
  EXPECT_EQ(json["vertices"], 3);
  EXPECT_EQ(json["skins"], 0);
  EXPECT_EQ(json["members"]["mesh 0"]["morph_targets"], 1);
  EXPECT_EQ(json["members"]["mesh 0"]["morph_target_names"][0], "billow");
  EXPECT_EQ(json["members"]["animation 0"]["seconds"], 1.5);
  EXPECT_EQ(json["members"]["animation 0"]["channels"]["translation"], 1);
}

#ifdef ATELIER_HAS_BODYMODEL
TEST_F(Inspect, GltfWithoutBindMatrices_IsSaidToBeTorn) {
  const std::string file = (source_directory() / "tests/bodymodel/files/no_ibm.gltf").string();
  const auto json = nlohmann::json::parse(run({"inspect", file, "--json"}).out);
  ASSERT_EQ(json["findings"].size(), 1U) << json["findings"];
  EXPECT_EQ(json["findings"][0]["code"], "gltf-binds");
  EXPECT_EQ(json["findings"][0]["severity"], "warning");
  const std::string out = (root_ / "out.obj").string();
  EXPECT_THAT(run({"convert", file, out}).out, HasSubstr("gltf-binds"));
}

TEST_F(Inspect, MarkersOfTwoPeople_AreToldWithTheirNames) {
  MarkerClip clip = marked_person(plug_in_gait_names()).clip;
  const std::vector<std::string> names = clip.markers;
  clip.markers.clear();
  for (const char* person : {"Ada:", "Ben:"}) {
    for (const std::string& name : names) {
      clip.markers.push_back(person + name);
    }
  }
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    Points both(2 * clip.positions[f].rows(), 3);
    both << clip.positions[f], clip.positions[f].rowwise() + Eigen::RowVector3d(1.5, 0, 0);
    clip.positions[f] = both;
    clip.seen[f].assign(2 * names.size(), true);
  }
  const std::string counts = "(" + std::to_string(names.size()) + " markers)";
  const std::vector<std::byte> c3d = C3dWriter(C3dWriteOptions{}).file(clip);
  std::ofstream(root_ / "two.c3d", std::ios::binary)
      .write(reinterpret_cast<const char*>(c3d.data()), std::ssize(c3d));
  std::ofstream(root_ / "two.trc") << fixtures::trc_text(clip, "m");
  for (const char* file : {"two.c3d", "two.trc"}) {
    EXPECT_THAT(run({"inspect", (root_ / file).string()}).out,
                AllOf(HasSubstr("motion-subjects"),
                      HasSubstr("2 people: Ada " + counts + ", Ben " + counts),
                      HasSubstr("--markers.subject 'Ada'")))
        << file;
  }
}
#endif

TEST_F(Inspect, GltfVerticesSplitAtSeams_AreNotErrors) {
  Mesh mesh;  // two triangles that share one vertex, as where two seams meet
  mesh.vertices.resize(5, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, -1, 0, 0, -1, -1, 0;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 3, 4;
  write_gltf(root_ / "parted.glb", gltf_scene(mesh, "parted"));
  const ChildResult parted = run({"inspect", (root_ / "parted.glb").string()});
  EXPECT_EQ(parted.exit_code, 0) << parted.err;
  EXPECT_THAT(parted.out + parted.err, HasSubstr("non-manifold-vertex"));
  write_mesh(root_ / "parted.obj", mesh);
  EXPECT_EQ(run({"inspect", (root_ / "parted.obj").string()}).exit_code, kExitBadData);
}

TEST_F(Inspect, FoldersAndToml_AreShown) {
  write_boxes(input(), 3);
  EXPECT_THAT(run({"inspect", input().string()}).out,
              AllOf(HasSubstr("meshes, one a frame"), HasSubstr("frames            3")));
  run_statistics({});
  EXPECT_THAT(run({"inspect", (stage_folder() / "current").string()}).out,
              HasSubstr("manifest of a result of 'statistics'"));
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2030-12-31\n";
  EXPECT_THAT(run({"inspect", input().string()}).out,
              AllOf(HasSubstr("a capture's description"), HasSubstr("P. Doe, research"),
                    HasSubstr("cameras.json      none")));
  std::ofstream(root_ / "options.toml") << "[input]\nunit = 'cm'\n";
  EXPECT_THAT(run({"inspect", (root_ / "options.toml").string()}).out,
              AllOf(HasSubstr("kind              TOML\n"), HasSubstr("input.unit      cm")));
  std::ofstream(root_ / "cameras.toml")
      << "[cam_01]\nsize = [640, 480]\nmatrix = [[900, 0, 320], [0, 910, 240], [0, 0, 1]]\n"
         "distortions = [0, 0, 0, 0]\nrotation = [0, 0, 0]\ntranslation = [0, 0, 3]\n[metadata]\n"
         "names = ['left', 'right']\n";
  EXPECT_THAT(run({"inspect", (root_ / "cameras.toml").string()}).out,
              AllOf(HasSubstr("cameras in TOML"), HasSubstr("[[900,0,320],[0,910,240],[0,0,1]]"),
                    HasSubstr("[\"left\",\"right\"]")));
}

// What libraries say of damaged files never stands beside the program's own line.
#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // their reports need the stream
TEST_F(Inspect, DamagedFiles_GiveOneLine) {
  const std::filesystem::path folder = source_directory() / "tests/hostile/malformed";
  int refused = 0;
  for (const char* name :
       {"tiff/truncated.tif", "tiff/strip_beyond.tif", "avif/payload_ones.avif",
        "avif/payload_zero.avif", "avif/size_other.avif", "fbx/weight_beyond.fbx"}) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(std::filesystem::exists(folder / name));
    const ChildResult result = run({"inspect", (folder / name).string()});
    EXPECT_LE(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    refused += result.exit_code == kExitBadData ? 1 : 0;
  }
  EXPECT_GE(refused, 5);
}

TEST_F(Inspect, EmptyFiles_AreRefusedInOneLine) {
  for (const char* name : {"e.obj", "e.ply", "e.glb", "e.png", "e.npy", "e.npz", "e.h5", "e.json",
                           "e.bvh", "e.fbx", "e.safetensors"}) {
    std::ofstream(root_ / name);
    const ChildResult result = run({"inspect", (root_ / name).string()});
    EXPECT_EQ(result.exit_code, kExitBadData) << name << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

TEST_F(Inspect, SkippedContent_IsReported) {
  std::ofstream(root_ / "half.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nwhatever 3\n"
                                       "g left\nf 1/1 2/2 3\n";
  for (const char* code : {"obj-skipped", "mesh-uvs-dropped", "mesh-names-dropped"}) {
    EXPECT_THAT(run({"inspect", (root_ / "half.obj").string()}).out, HasSubstr(code));
    EXPECT_THAT(run({"convert", (root_ / "half.obj").string(), (root_ / "out.ply").string()}).out,
                HasSubstr(code));
  }
}

TEST_F(Inspect, ZeroAreaFaces_AreFound) {
  std::ofstream(root_ / "flat.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 0 0 0\n"
                                       "f 1 2 3\nf 1 2 4\nf 1 5 3\n";
  EXPECT_THAT(run({"inspect", (root_ / "flat.obj").string()}).out,
              AllOf(HasSubstr("flat-face"), HasSubstr("[face 1]"),
                    HasSubstr("2 faces without area, this one the first")));
  std::ofstream(root_ / "TWICE.OBJ") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 3\n";
  EXPECT_THAT(
      run({"inspect", (root_ / "TWICE.OBJ").string()}).out,
      AllOf(HasSubstr("degenerate-face"), Not(HasSubstr("flat-face")), Not(HasSubstr("m3"))));
  std::ofstream(root_ / "POINTS.OBJ") << "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_THAT(run({"inspect", (root_ / "POINTS.OBJ").string()}).out, HasSubstr("mesh-cut-off"));
}

TEST_F(Inspect, FoldersRefusedByStages_AreReported) {
  write_boxes(input(), 2);
  std::filesystem::create_symlink(input() / "box_000.obj", input() / "box_002.obj");
  const ChildResult linked = run({"inspect", input().string()});
  EXPECT_EQ(linked.exit_code, 0) << "links are followed";
  std::filesystem::remove(input() / "box_002.obj");
  std::filesystem::create_symlink("/etc/hostname", input() / "box_002.obj");
  const ChildResult outside = run({"inspect", input().string()});
  EXPECT_EQ(outside.exit_code, kExitBadData);
  EXPECT_THAT(outside.out + outside.err, HasSubstr("box_002.obj"));
  std::filesystem::remove(input() / "box_002.obj");
  std::filesystem::create_directories(root_ / "half");
  std::ofstream(root_ / "half" / "synthesis.json") << "{}";
  EXPECT_THAT(run({"inspect", (root_ / "half").string()}).err,
              HasSubstr("a synthetic capture that was interrupted"));
}

TEST_F(Inspect, DamagedVideo_GivesOneLine) {
  std::filesystem::create_directory(input());
  std::ofstream(input() / "cam0.mp4") << std::string(
                                             "\0\0\0\x18"
                                             "ftypisom\0\0\2\0isommp41",
                                             24)
                                      << std::string("\0\0\1\0mdat", 8) << "cut";
  expect_refusal(run({"calibrate", input().string(), "--out", (root_ / "out").string()}),
                 kExitBadData, "cam0.mp4");
}
#endif

#if defined(ATELIER_HAS_CAPTURE_LAYOUTS) && defined(ATELIER_HAS_CORE_RENDER)
TEST_F(Inspect, Videos_AreDecoded) {
  const std::filesystem::path path = root_ / "a.mp4";
  write_video(path, 24, [](Index i) {
    Image image(64, 48, 3);
    for (std::size_t k = 0; k < image.data.size(); ++k) {
      image.data[k] = static_cast<float>((k * k * (static_cast<std::size_t>(i) + 7)) % 251) / 250;
    }
    return image;
  });
  const Inspection sound = inspect_path(path);
  EXPECT_THAT(sound.findings, ::testing::IsEmpty());
  std::string bytes = read_file_text(path.string(), 1 << 24);
  const std::size_t begin = bytes.find("mdat") + 4;
  ASSERT_LT(begin, bytes.size() / 2) << "the index is in front";
  const std::size_t size = bytes.size() - begin;
  const std::string damaged = bytes.replace(begin + size / 3, size / 3, size / 3, '\0');
  std::ofstream(path, std::ios::binary) << damaged;
  expect_refusal(run({"inspect", path.string()}), kExitBadData, "frame ");
  std::ofstream(path, std::ios::binary) << damaged.substr(0, begin + size / 3);
  EXPECT_THROW(inspect_path(path), DataError);
}
#endif

TEST_F(Inspect, TextFilesOfOtherPrograms_AreRecognized) {
  const auto said = [&](const char* name, const std::string& text) {
    std::ofstream(root_ / name, std::ios::binary) << text;
    const ChildResult result = run({"inspect", (root_ / name).string()});
    EXPECT_EQ(result.exit_code, 0) << name << ": " << result.err;
    return result.out;
  };
  EXPECT_THAT(said("a.svg",
                   "<?xml version=\"1.0\"?>\n<svg xmlns=\"x\" width=\"210mm\" "
                   "height=\"297mm\"><path/></svg>"),
              AllOf(HasSubstr("drawing, SVG"), HasSubstr("210mm"), HasSubstr("297mm")));
  EXPECT_THAT(said("a.dxf",
                   "999\r\nmade by us\r\n  0\r\nSECTION\r\n  2\r\nHEADER\r\n  9\r\n"
                   "$INSUNITS\r\n 70\r\n     4\r\n  0\r\nENDSEC\r\n  0\r\nEOF\r\n"),
              AllOf(HasSubstr("drawing, DXF"), HasSubstr("unit              mm\n")));
  EXPECT_THAT(said("a.usda",
                   "#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = \"Y\"\n"
                   "    endTimeCode = 5\n)\n\ndef Xform \"root\"\n{\n}\n"),
              AllOf(HasSubstr("metres per unit   1\n"), HasSubstr("up axis           Y\n"),
                    HasSubstr("last frame        5\n")));
  EXPECT_THAT(said("bare.usda", "#usda 1.0\n"), HasSubstr("0.01: the file does not say"));
  EXPECT_THAT(said("a.html", "<!doctype html>\n<title>A report</title>"),
              AllOf(HasSubstr("page, HTML"), HasSubstr("A report")));
  EXPECT_THAT(said("a.csv", "frame,depth\r\n0,1\r\n1,2\r\n\r\n"),
              AllOf(HasSubstr("rows              2\n"), HasSubstr("frame depth")));
  EXPECT_THAT(said("a.jsonl", "{\"frame\": 1}\n{\"frame\": 2}\n{\"fra"),
              AllOf(HasSubstr("lines             2\n"), HasSubstr("torn-line")));
}

TEST_F(Inspect, TextNotMatchingItsExtension_IsRefused) {
  for (const auto& [name, text, word] :
       {std::tuple{"a.svg", "%PDF-1.4", "%PDF-1.4"},
        {"empty.svg", "", "an empty file"},
        {"a.dxf", "AutoCAD Binary DXF", "SECTION"},
        {"comment.dxf", "999", "its value"},
        {"a.usda", "PXR-USDC", "#usda 1.0"},
        {"a.html", "<svg/>", "doctype"},
        {"a.csv", "\n1,2\n", "columns"},
        {"a.jsonl", "{\"frame\": \n", "line 1"},
        {"a.zip", "PK", "zip"},
        {"a.pkl", "x", "pickle"},
        {"a.pt", "x", "torch"},
        {"a.onnx", "x", "detect"},
        {"tag.svg", "<svg", "the end of the text; expected <svg ...>"},
        {"torn.csv", "a,b\n1,2\n3\n", "line 3"},
        {"a.usd", "PXR-USDC", "version"},
        {"a.abc", "Ogawa", "Alembic"},
        {"a.asf", ":version 1.10", ".amc"},
        {"a.xcp", "<Cameras/>", "Pose2Sim"},
        {"a.vst", "<vst/>", "a table of sizes"},
        {"a.vit", "", "an empty file"},
        {"notes.txt", "x", "expected the capture's folder"},
        {"a.bin", "x", "capture's folder"},
        {"a.yml", "a: 1\n", "%YAML"},
        {"a.mp4", "x", "a.mp4"},
        {"a.target", "0 1 2\n", "line 1"},
        {"a.mhclo", "name tee\n", "a.mhclo"},
        {"a.xyz", "x", "not known"}}) {
    std::ofstream(root_ / name, std::ios::binary) << text;
    SCOPED_TRACE(name);
    expect_refusal(run({"inspect", (root_ / name).string()}), kExitBadData, word);
  }
}

TEST_F(Inspect, JsonDocuments_AreRecognized) {
  const std::filesystem::path corpus = source_directory() / "fuzz/corpus";
  for (const auto& [file, kind] : {std::pair{"cameras/small.json", "cameras of a capture"},
                                   {"pattern/small.json", "sewing pattern"},
                                   {"openpose/small.json", "OpenPose"},
                                   {"easymocap_annotation/small.json", "EasyMocap"},
                                   {"goliath/small.json", "Goliath"},
                                   {"panoptic/small.json", "cameras, Panoptic"},
                                   {"human36m/small.json", "Human3.6M"},
                                   {"nerfstudio/small.json", "nerfstudio"},
                                   {"rig/small.json", "rig, MakeHuman"},
                                   {"run_account/small.json", "account of a run"}}) {
    EXPECT_THAT(run({"inspect", (corpus / file).string()}).out, HasSubstr(kind)) << file;
  }
}

TEST_F(Inspect, SewingPattern_ShowsItsPanels) {
  const std::filesystem::path file = source_directory() / "fuzz/corpus/pattern/cubic.json";
  const nlohmann::json seen = nlohmann::json::parse(run({"inspect", file.string(), "--json"}).out);
  EXPECT_EQ(seen["panels"], 2);
  EXPECT_EQ(seen["seams"], 2);
  EXPECT_EQ(seen["edges"], 8);
  EXPECT_NEAR(seen["highest"].get<double>(), 1.03, 1e-9);
  EXPECT_NEAR(seen["lowest"].get<double>(), 0.48, 1e-9);
  // A trapezium of 44 and 70 cm, 55 cm high, less what the waist's curve takes.
  EXPECT_NEAR(seen["members"]["front"].get<double>(), 0.55 * 0.57, 0.01);
  EXPECT_NEAR(seen["area"].get<double>(), 2 * seen["members"]["front"].get<double>(), 1e-6);
}

TEST_F(Inspect, MakeHumanAndCaptureFiles_AreShown) {
  const std::filesystem::path corpus = source_directory() / "fuzz/corpus";
  EXPECT_THAT(run({"inspect", (corpus / "mhclo/small.mhclo").string()}).out,
              HasSubstr("MakeHuman garment"));
  EXPECT_THAT(run({"inspect", (corpus / "target/small.target").string()}).out,
              HasSubstr("vertices moved"));
  EXPECT_THAT(run({"inspect", (corpus / "measurements/small.vit").string()}).out,
              AllOf(HasSubstr("measurements of one person"), HasSubstr("cm"), HasSubstr("height"),
                    HasSubstr("1.68 m")));
  std::ofstream(root_ / "inches.vit")
      << "<vit><unit>cm</unit><m name=\"height\" value=\"70\"/></vit>";
  EXPECT_THAT(run({"inspect", (root_ / "inches.vit").string()}).out,
              HasSubstr("height is 0.7 m, in cm as the file says"));
  std::ofstream(root_ / "intri.yml")
      << "%YAML:1.0\n---\nK_1: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: d\n"
         "   data: [ 900., 0. ]\n";
  EXPECT_THAT(run({"inspect", (root_ / "intri.yml").string()}).out,
              AllOf(HasSubstr("OpenCV's YAML"), HasSubstr("K_1             float64 [1,2]")));
  std::filesystem::copy_file(corpus / "colmap_matrix/small.bin", root_ / "a.png.geometric.bin");
  EXPECT_THAT(run({"inspect", (root_ / "a.png.geometric.bin").string()}).out,
              HasSubstr("COLMAP's matrix"));
  std::ofstream(root_ / "cameras.txt") << "1 PINHOLE 640 480 500 500 320 240\n";
  EXPECT_THAT(run({"inspect", (root_ / "cameras.txt").string()}).out,
              AllOf(HasSubstr("cameras, COLMAP"), HasSubstr("width 640")));
}

TEST_F(Inspect, EveryCorpusFile_IsDescribedOrRefusedInOneLine) {
  int described = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(source_directory() / "fuzz/corpus")) {
    if (!entry.is_regular_file() || !entry.path().filename().string().starts_with("small.")) {
      continue;
    }
    SCOPED_TRACE(entry.path());
    const ChildResult result = run({"inspect", entry.path().string()});
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == kExitBadData) << result.exit_code;
    EXPECT_LE(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.out.empty(), result.err.empty()) << result.out << result.err;
    described += result.out.empty() ? 0 : 1;
  }
  EXPECT_GT(described, 50);
}

TEST_F(Inspect, DamagedResult_IsFound) {
  write_boxes(input(), 1);
  run_statistics({});
  std::filesystem::remove(stage_folder() / "current/statistics.json");
  EXPECT_THAT(run({"inspect", (stage_folder() / "current/manifest.json").string()}).out,
              HasSubstr("output-missing"));
  EXPECT_EQ(run({"inspect", (stage_folder() / "current/manifest.json").string()}).exit_code,
            kExitBadData);
}

}  // namespace
}  // namespace atelier::fixtures
