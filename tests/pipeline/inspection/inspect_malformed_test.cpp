// `inspect` of the hand-made malformed files: each is refused, or has a finding.

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <span>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/archive.h"
#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/io/drawing_text.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/io/npz.h"
#include "core/io/page_text.h"
#include "core/io/safetensors.h"
#include "core/io/table_text.h"
#include "core/io/zip_archive.h"
#include "core/sequence_archive.h"
#include "fuzz/body_arrays.h"
#include "fuzz/forged_archive.h"
#include "pipeline/inspection/inspection.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::byte> bytes_in(const fs::path& path) {
  return read_file_bytes(path, 1 << 26);
}

void write_bytes(const fs::path& path, const std::vector<std::byte>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

/// The file as a user has it, who does not give `inspect` a fuzzer's container: an archive with its
/// digest put right, so that its schema is come to; arrays of a safetensors file in the npz or the
/// archive that they are kept in; a document under its name.
fs::path as_users_have_it(const std::string& reader, const fs::path& file, const fs::path& folder) {
  static const std::map<std::string, std::string> names = {{"manifest", "manifest.json"},
                                                           {"capture_info", "capture.toml"},
                                                           {"consent", "consent.toml"},
                                                           {"materials", "material.json"},
                                                           {"colmap_matrix", "a.geometric.bin"}};
  if (const auto name = names.find(reader); name != names.end()) {
    write_bytes(folder / name->second, bytes_in(file));
    return folder / name->second;
  }
  if (file.extension() == ".h5" && reader != "archive") {
    write_bytes(folder / "file.h5", fuzz::with_right_digest(bytes_in(file)));
    return folder / "file.h5";
  }
  if (reader == "mesh_sequence") {
    Archive archive;
    archive.schema = "atelier.mesh_sequence";
    for (auto& [name, tensor] : parse_safetensors(bytes_in(file), "").tensors) {
      put_array(archive, name, std::move(tensor));
    }
    write_archive(folder / "file.h5", archive);
    return folder / "file.h5";
  }
  if (reader == "body_archive" || reader == "personal_body" || reader == "smpl" ||
      reader == "amass") {
    std::map<std::string, Tensor> arrays;
    if (reader == "smpl" || reader == "amass") {
      arrays = parse_safetensors(bytes_in(file), "").tensors;
    } else {
      std::map<std::string, std::vector<std::string>> more;
      if (reader == "personal_body") {
        more = {
            {"shape_names", {}}, {"shape_units", {}}, {"person_shape_names", {"stature", "mass"}}};
      }
      const Npz npz = fuzz::body_npz(bytes_in(file), more);
      for (const std::string& name : npz.names()) {
        arrays[name] = npz.read(name);
      }
    }
    write_bytes(folder / "file.npz", npz_bytes(arrays, false));
    return folder / "file.npz";
  }
  return file;
}

/// Sound by themselves, wrong only beside what their reader is given with them, which one file does
/// not say; or read by `inspect` as what else they may be.
const std::map<std::string, std::set<std::string>>& sound_alone() {
  static const std::map<std::string, std::set<std::string>> files = {
      // Arrays, tables and documents that do not say what they should be.
      {"amass", {"no_poses.safetensors"}},
      {"smpl", {"no_template.safetensors"}},
      {"appearance_model", {"schema_missing.safetensors", "schema_other.safetensors"}},
      {"simulated_frame", {"schema_other.h5"}},  // a good one of that schema
      {"archive", {"plain_hdf5.h5"}},            // HDF5 of others
      {"camera_toml", {"none.toml"}},
      {"cameras", {"no_cameras.json", "root_array.json"}},
      {"capture_info", {"no_schema.toml"}},  // consent alone is in order
      {"easymocap_annotation", {"no_annots.json"}},
      {"goliath", {"no_krt.json"}},
      {"human36m", {"list.json", "no_extrinsics.json", "no_intrinsics.json"}},
      {"keypoints3d", {"no_points.json", "nothing.json", "person_number.json", "text_alone.json"}},
      {"nerfstudio", {"no_focal.json"}},
      {"manifest", {"not_object.json", "other_schema.json"}},
      {"openpose", {"list.json", "no_people.json"}},
      {"panoptic", {"list.json", "no_cameras.json"}},
      {"pattern", {"list.json"}},
      {"run_account", {"no_object.json"}},
      // Of another size than the image that was asked for, or beyond the base mesh, or another
      // mesh's.
      {"seams",
       {"empty.json", "list.json", "no_edge.json", "panels_few.json", "vertex_range.json"}},
      {"painted_picture", {"larger.h5", "smaller.h5", "turned.h5"}},
      {"mhclo", {"delete_often.mhclo", "range.mhclo", "scale_vertex.mhclo"}},
      {"rig",
       {"cube.json", "list.json", "strategy.json", "vertex.json", "weights.json",
        "weights_bone.json", "weights_vertex.json"}},
      {"target", {"range.target"}}};
  return files;
}

class InspectMalformed : public ::testing::TestWithParam<std::string> {};

TEST_P(InspectMalformed, MalformedFile_IsRefusedOrHasAFinding) {
  const std::string reader = GetParam();
  const TemporaryDirectory folder;
  std::set<std::string> silent;
  int seen = 0;
  for (const auto& entry :
       fs::directory_iterator(source_directory() / "tests/hostile/malformed" / reader)) {
    const std::string name = entry.path().filename().string();
    if (name == "index.txt") {
      continue;
    }
    SCOPED_TRACE(name);
    ++seen;
    try {
      const fs::path file = as_users_have_it(reader, entry.path(), folder.path());
      if (inspect_path(file).findings.empty()) {
        silent.insert(name);
      }
    } catch (const DataError& error) {
      EXPECT_FALSE(error.found.empty()) << error.what();
    }
  }
  EXPECT_GE(seen, 15);
  const auto sound = sound_alone().find(reader);
  EXPECT_EQ(silent, sound == sound_alone().end() ? std::set<std::string>() : sound->second);
}

INSTANTIATE_TEST_SUITE_P(
    Readers, InspectMalformed,
    ::testing::Values("amass", "animated_frame", "appearance_colors", "appearance_data",
                      "appearance_model", "archive", "avif", "bmp", "body_archive", "bvh", "c3d",
                      "camera_toml", "cameras", "capture_info", "cloth_state", "colmap_matrix",
                      "consent", "csv", "dxf", "easymocap_annotation", "foreign_hdf5", "garment",
                      "gltf", "goliath", "html", "human36m", "jpeg", "json", "json_lines",
                      "keypoints3d", "manifest", "materials", "mesh_sequence", "mhclo",
                      "nerfstudio", "npy", "npz", "obj", "openpose", "painted_picture",
                      "painted_scene", "panoptic", "pattern", "personal_body", "ply", "png",
                      "qualisys", "rig", "run_account", "safetensors", "seams", "sequence_header",
                      "simulated_frame", "smpl", "stl", "svg", "synthesis_state", "target", "tiff",
                      "toml", "tracked_motion", "training", "trc", "truth", "usda", "webp", "zip"),
    [](const auto& instance) { return instance.param; });

TEST(InspectArchives, GroundTruthFrame_IsCheckedAgainstItsCapture) {
  const fs::path corpus = source_directory() / "fuzz/corpus";
  const TemporaryDirectory folder;
  fs::create_directories(folder / "truth/frames");
  const fs::path frame = folder / "truth/frames/000000.h5";
  write_bytes(frame, fuzz::with_right_digest(bytes_in(corpus / "truth_frame/small.h5")));
  const Inspection alone = inspect_path(frame);
  ASSERT_EQ(alone.findings.size(), 1u);
  EXPECT_EQ(alone.findings[0].code, "schema-not-judged");
  EXPECT_FALSE(has_errors(alone.findings));
  write_bytes(folder / "truth/truth.h5",
              fuzz::with_right_digest(bytes_in(corpus / "truth/small.h5")));
  EXPECT_THROW(inspect_path(frame), DataError) << "it is of another capture";
}

TEST(InspectArchives, UnknownSchema_IsReported) {
  const TemporaryDirectory folder;
  Archive archive;
  archive.schema = "atelier.of_tomorrow";
  archive.version = 7;
  put_array(archive, "values", tensor_of(std::vector<double>{1, NAN, INFINITY, 4}, {2, 2}));
  write_archive(folder / "file.h5", archive);
  const Inspection inspection = inspect_path(folder / "file.h5");
  ASSERT_EQ(inspection.findings.size(), 2u);
  EXPECT_EQ(to_string(inspection.findings[0]).find("warning not-finite [values[0,1]]"), 0u)
      << to_string(inspection.findings[0]);
  EXPECT_THAT(to_string(inspection.findings[1]), HasSubstr("atelier.of_tomorrow"));
  EXPECT_FALSE(has_errors(inspection.findings));
}

TEST(InspectArchives, LaterVersion_IsRefused) {
  const TemporaryDirectory folder;
  Archive archive;
  archive.schema = "atelier.garment";
  archive.version = 2;
  write_archive(folder / "file.h5", archive);
  try {
    inspect_path(folder / "file.h5");
    FAIL() << "it was read";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a newer program wrote it"));
  }
}

TEST(InspectArchives, ValidArchive_HasNoFinding) {
  const fs::path corpus = source_directory() / "fuzz/corpus";
  const TemporaryDirectory folder;
  for (const char* file :
       {"garment/full.h5", "truth/full.h5", "tracked_motion/small.h5", "appearance_data/small.h5",
        "painted_scene/small.h5", "simulated_frame/small.h5", "animated_frame/small.h5",
        "cloth_state/small.h5", "synthesis_state/small.h5", "sequence_header/small.h5"}) {
    SCOPED_TRACE(file);
    write_bytes(folder / "file.h5", fuzz::with_right_digest(bytes_in(corpus / file)));
    EXPECT_THAT(inspect_path(folder / "file.h5").findings, IsEmpty());
  }
}

TEST(InspectHdf5, NonFiniteForeignNumbers_AreAWarning) {
  const TemporaryDirectory folder;
  std::vector<std::byte> bytes = bytes_in(source_directory() / "fuzz/corpus/foreign_hdf5/early.h5");
  const std::array<double, 2> begin = {1, 0};  // of a [3,3] that is 1, 0, 0, 0, ...
  const auto mark = std::as_bytes(std::span(begin));
  const auto at = std::search(bytes.begin(), bytes.end(), mark.begin(), mark.end());
  ASSERT_NE(at, bytes.end());
  write_bytes(folder / "file.h5", bytes);
  EXPECT_THAT(inspect_path(folder / "file.h5").findings, IsEmpty());
  const std::array<double, 2> wrong = {1, NAN};
  std::ranges::copy(std::as_bytes(std::span(wrong)), at);
  write_bytes(folder / "file.h5", bytes);
  const std::vector<Finding> findings = inspect_path(folder / "file.h5").findings;
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].code, "not-finite");
  EXPECT_EQ(findings[0].place, "Camera/00/K[0,1]");
}

TEST(InspectArrays, NonFiniteComplexNumbers_AreAWarning) {
  Tensor tensor = tensor_of(std::vector<float>{1, 2, 3, NAN, INFINITY, 0}, {3, 2});
  tensor.type = ElementType::Complex64;
  tensor.shape = {3};
  Inspection inspection;
  add_array("z", tensor, inspection);
  ASSERT_EQ(inspection.findings.size(), 1u);
  EXPECT_EQ(inspection.findings[0].place, "z[1]");
  EXPECT_EQ(inspection.members[0].value["not_finite"], 2);
}

TEST(InspectZip, NamesEscapingTheFolder_AreErrors) {
  const TemporaryDirectory folder;
  for (const char* name : {"../../x", "a/../../x", "/etc/x", "..\\x", "C:\\x", "a/.."}) {
    SCOPED_TRACE(name);
    write_bytes(folder / "file.zip", zip_bytes({{"a.txt", {}}, {name, {}}}, false));
    const std::vector<Finding> findings = inspect_path(folder / "file.zip").findings;
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_EQ(findings[0].code, "zip-name");
    EXPECT_EQ(findings[0].place, name);
    EXPECT_TRUE(has_errors(findings));
  }
  write_bytes(folder / "file.zip", zip_bytes({{"a/b.txt", {}}, {"..a/b..", {}}}, false));
  EXPECT_THAT(inspect_path(folder / "file.zip").findings, IsEmpty());
}

TEST(InspectZip, SymbolicLinks_AreErrors) {
  const TemporaryDirectory folder;
  std::vector<std::byte> bytes = zip_bytes({{"a", {std::byte{'/'}}}, {"a/passwd", {}}}, false);
  const std::string_view mark = "PK\1\2";  // of the list of members, "a" first
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t member = text.find(mark);
  ASSERT_NE(member, std::string_view::npos);
  bytes[member + 40] = std::byte{0xFF};  // the mode 0120777
  bytes[member + 41] = std::byte{0xA1};
  write_bytes(folder / "file.zip", bytes);
  const std::vector<Finding> findings = inspect_path(folder / "file.zip").findings;
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].code, "zip-link");
  EXPECT_EQ(findings[0].place, "a");
  EXPECT_TRUE(has_errors(findings));
}

TEST(InspectZip, DamagedMember_IsRefused) {
  const TemporaryDirectory folder;
  std::vector<std::byte> bytes = zip_bytes({{"a.txt", std::vector<std::byte>(100)}}, false);
  bytes[60] ^= std::byte{1};  // of the hundred
  write_bytes(folder / "file.zip", bytes);
  EXPECT_THROW(inspect_path(folder / "file.zip"), DataError);
}

TEST(InspectZip, ExcessiveInflation_IsRefused) {
  const std::vector<std::byte> zeros(1000);
  const std::vector<std::byte> bytes = zip_bytes({{"a", zeros}, {"b", zeros}}, true);
  Limits limits;
  limits.inflate_free_bytes = 1000;
  limits.inflate_ratio = 2;
  EXPECT_NO_THROW(ZipArchive(bytes, "zip").check());
  EXPECT_THROW(ZipArchive(bytes, "zip", limits).check(), DataError)
      << "each is small enough, not both";
}

constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST(InspectConsent, ExpiredConsent_IsAWarningInEveryLayout) {
  const TemporaryDirectory folder;
  constexpr const char* kEnded =
      "[[consent]]\nwho = 'P. Doe'\nscope = 'research'\nuntil = '2020-12-31'\n";
  const auto codes = [](const fs::path& path) {
    std::vector<std::string> found;
    for (const Finding& finding : inspect_path(path).findings) {
      found.push_back(finding.code);
    }
    return found;
  };
  for (const char* name : {"consent.toml", "capture.toml"}) {
    SCOPED_TRACE(name);
    std::ofstream(folder / name) << kEnded;
    EXPECT_THAT(codes(folder / name), ::testing::ElementsAre("consent-ended"));
  }
  fs::remove(folder / "consent.toml");
  EXPECT_THAT(codes(folder.path()), ::testing::ElementsAre("consent-ended"));
  // A layout that has no place for it: images alone.
  fs::remove(folder / "capture.toml");
  std::ofstream(folder / "consent.toml") << kEnded;
  fs::create_directories(folder / "images/a");
  write_bytes(folder / "images/a/000000.png",
              bytes_in(source_directory() / "fuzz/corpus/png/grey1.png"));
  EXPECT_THAT(codes(folder.path()), ::testing::Contains("consent-ended"));
  EXPECT_THAT(text_of(inspect_path(folder.path())), HasSubstr("P. Doe, research"));
  const TemporaryDirectory meshes;
  std::ofstream(meshes / "m_0.obj") << kTriangle;
  std::ofstream(meshes / "consent.toml") << kEnded;
  EXPECT_THAT(codes(meshes.path()), ::testing::ElementsAre("consent-ended"));
  const TemporaryDirectory sequence;
  write_sequence(sequence.path(), sequence_of({read_mesh(meshes / "m_0.obj")}, 25));
  std::ofstream(sequence / "consent.toml") << kEnded;
  EXPECT_THAT(codes(sequence.path()), ::testing::ElementsAre("consent-ended"));
  for (const fs::path& place : {folder.path(), meshes.path(), sequence.path()}) {
    std::ofstream(place / "consent.toml") << "[[consents]]\nwho = 'a'\nscope = 'b'\n";
    EXPECT_THROW(inspect_path(place), DataError) << "a table misspelt";
    std::ofstream(place / "consent.toml").close();
    EXPECT_THROW(inspect_path(place), DataError) << "emptied, as a full disk leaves it";
  }
  EXPECT_THROW(inspect_path(folder / "consent.toml"), DataError);
}

TEST(InspectMeshes, MeshFrames_AreRead) {
  const TemporaryDirectory folder;
  const auto codes = [&] {
    std::vector<std::string> found;
    for (const Finding& finding : inspect_path(folder.path()).findings) {
      found.push_back(finding.code);
    }
    return found;
  };
  for (int i = 0; i < 16; ++i) {
    std::ofstream(folder / ("m_" + std::to_string(i) + ".obj")) << kTriangle;
  }
  EXPECT_THAT(codes(), IsEmpty());
  fs::remove(folder / "m_5.obj");
  EXPECT_THAT(codes(), ::testing::ElementsAre("frame-numbers-missing"));
  std::ofstream(folder / "m_5.obj") << "garbage\n";
  EXPECT_THROW(codes(), DataError);
  // Of many a few are read, and it says so.
  std::ofstream(folder / "m_16.obj") << kTriangle;
  EXPECT_THAT(codes(), ::testing::ElementsAre("frames-not-read"));
  std::ofstream(folder / "m_16.obj") << "garbage\n";
  EXPECT_THROW(codes(), DataError);
  std::ofstream(folder / "m_16.obj") << kTriangle;
  std::ofstream(folder / "m_0.obj") << "v 0 0 0\nv 0 1800 0\nv 500 0 0\nf 1 2 3\n";
  EXPECT_THAT(codes(), ::testing::ElementsAre("frames-not-read", "unit-unknown"));
}

TEST(InspectImage, ExtensionOfAnotherFormat_IsANote) {
  const TemporaryDirectory folder;
  const auto png = bytes_in(source_directory() / "fuzz/corpus/png/grey1.png");
  write_bytes(folder / "picture.PNG", png);
  EXPECT_THAT(inspect_path(folder / "picture.PNG").findings, IsEmpty());
  write_bytes(folder / "picture.jpg", png);
  const std::vector<Finding> findings = inspect_path(folder / "picture.jpg").findings;
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::Note);
  EXPECT_EQ(findings[0].what, "the name says JPEG, the content is PNG");
}

TEST(InspectCapture, MeshInACaptureFolder_IsNotASequence) {
  const TemporaryDirectory folder;
  fs::create_directories(folder / "calibration");
  write_bytes(folder / "calibration/Calib.toml",
              bytes_in(source_directory() / "fuzz/corpus/camera_toml/small.toml"));
  const auto kind = [&] {
    return inspect_path(folder.path()).facts.at(1).value.get<std::string>();  // after the folder
  };
  ASSERT_THAT(kind(), HasSubstr("capture"));
  std::ofstream(folder / "scan.obj") << kTriangle;
  EXPECT_THAT(kind(), HasSubstr("capture"));
  std::ofstream(folder / "scan_1.obj") << kTriangle;
  EXPECT_THAT(kind(), HasSubstr("capture"));
  // Beside images alone, which may be textures, meshes with numbers are frames.
  fs::remove_all(folder / "calibration");
  fs::create_directories(folder / "images/a");
  write_bytes(folder / "images/a/000000.png",
              bytes_in(source_directory() / "fuzz/corpus/png/grey1.png"));
  EXPECT_THAT(kind(), HasSubstr("capture"));
  fs::remove(folder / "scan.obj");
  EXPECT_THAT(kind(), HasSubstr("meshes"));
  fs::remove_all(folder / "images");
  std::ofstream(folder / "scan.obj") << kTriangle;
  EXPECT_THROW(kind(), DataError) << "a mesh without a number";
}

TEST(InspectCapture, CaptureFiles_AreCheckedAgainstTheDescription) {
  const fs::path corpus = source_directory() / "fuzz/corpus";
  const TemporaryDirectory folder;
  const auto has = [&](const char* code) {
    return std::ranges::any_of(inspect_path(folder.path()).findings,
                               [&](const Finding& finding) { return finding.code == code; });
  };
  write_bytes(folder / "capture.toml", bytes_in(corpus / "capture_info/small.toml"));
  EXPECT_TRUE(has("cameras-missing"));
  write_bytes(folder / "cameras.json", bytes_in(corpus / "cameras/small.json"));
  EXPECT_TRUE(has("images-missing"));
  EXPECT_FALSE(has("cameras-missing"));
  fs::create_directories(folder / "images/01");
  write_bytes(folder / "images/01/000000.png", bytes_in(corpus / "png/grey1.png"));
  EXPECT_FALSE(has("images-missing"));
  EXPECT_THAT(text_of(inspect_path(folder.path())),
              ::testing::AllOf(HasSubstr("P. Doe, research"), HasSubstr("sequence walk")));
  std::ofstream(folder / "cameras.json") << "{\"cameras\":";
  EXPECT_THROW(inspect_path(folder.path()), DataError);
}

TEST(InspectTexts, TooManyTableColumns_AreRefused) {
  EXPECT_EQ(parse_csv("a" + std::string(65'535, ',') + "\n").columns.size(), 65'536u);
  EXPECT_THROW(parse_csv("a" + std::string(65'536, ',') + "\n"), DataError);
}

TEST(InspectTexts, UnfinishedLastJsonLine_IsAccepted) {
  const JsonLines sound = parse_json_lines("{}\n{\"a\": 1}");
  EXPECT_EQ(sound.lines, 2);
  EXPECT_THAT(sound.findings, IsEmpty());
  EXPECT_EQ(parse_json_lines("{}\n{\"a\": 1").lines, 1);
}

TEST(InspectTexts, HtmlPreambles_AreAccepted) {
  for (const char* begin : {"\xEF\xBB\xBF", "<!-- saved from elsewhere -->\n",
                            "<?xml version='1.0' encoding='UTF-8'?>\n", " <!-- a --><!-- b -->"}) {
    SCOPED_TRACE(begin);
    EXPECT_EQ(parse_html(std::string(begin) + "<!DOCTYPE html><title>A</title>").title, "A");
  }
}

TEST(InspectTexts, ValidXml_IsAccepted) {
  constexpr const char* kBegin = "<svg xmlns='http://www.w3.org/2000/svg'>";
  for (const char* inside :
       {"<é/>", "<text>&amp;&#xB5;]] ></text>", "<!-- a - b --><?a b?>", "<![CDATA[ & ]]>",
        "<g a='1'\n b='2'/>", "<text>\xF0\x9F\x91\x95</text>"}) {
    SCOPED_TRACE(inside);
    EXPECT_NO_THROW(parse_svg(std::string(kBegin) + inside + "</svg>"));
  }
  EXPECT_NO_THROW(parse_svg(std::string("<?xml version='1.0' encoding='ISO-8859-1'?>") + kBegin +
                            "<text>\xE9</text></svg>"))
      << "of another encoding";
  Limits limits;
  limits.text_values = 3;
  EXPECT_NO_THROW(parse_svg("<svg xmlns='http://www.w3.org/2000/svg' a='1'/>", "", limits));
  EXPECT_THROW(parse_svg("<svg xmlns='http://www.w3.org/2000/svg' a='1' b='2' c='3'/>", "", limits),
               DataError);
}

TEST(InspectTexts, TextOthersStillOpen_HasAFinding) {
  const TemporaryDirectory folder;
  for (const auto& [name, text, code] :
       {std::tuple{"a.csv", "a,b\n1,nan\n", "not-finite"},
        {"e.csv", "a,b\n1,+inf\n", "not-finite"},
        {"f.csv", "a,b\n1,INF\n", "not-finite"},
        {"g.csv", "a,b\n1,1.#IND\n", "not-finite"},
        {"h.csv", "a,b\n1,-1.#QNAN0\n", "not-finite"},
        {"i.csv", "a,b\n1,-nan(ind)\n", "not-finite"},
        {"b.csv", "a,b\n1,2", "torn-line"},
        {"c.csv", "a;b\n1;2\n", "csv-separator"},
        {"d.csv", "a,a\n1,2\n", "csv-column-twice"},
        {"a.jsonl", "{}\n{", "torn-line"},
        {"a.svg", "<svg/>", "svg-name-space"},
        {"b.svg", "<svg xmlns='http://www.w3.org/2000/svg'><path d='M 1,nan'/></svg>",
         "svg-not-finite"},
        {"a.usda", "#usda 1.0\ndef \"a\" { float x = -inf\n}\n", "usd-not-finite"},
        {"c.usda", "#usda 1.0\ndef \"a\" { float3 x = (1,  # of three\n nan, 2)\n}\n",
         "usd-not-finite"},
        {"d.usda", "#usda 1.0\ndef \"a\" { float x.timeSamples = { 0: 1, 1: +inf }\n}\n",
         "usd-not-finite"},
        {"b.usda", "#usda 1.0\n(startTimeCode = 2\nendTimeCode = 1)\n", "usd-time"}}) {
    SCOPED_TRACE(name);
    std::ofstream(folder / name, std::ios::binary) << text;
    const std::vector<Finding> findings = inspect_path(folder / name).findings;
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_EQ(findings[0].code, code);
  }
}

TEST(InspectTexts, NamesLikeNanAndInf_AreNotNumbers) {
  const TemporaryDirectory folder;
  for (const auto& [name, text] :
       {std::pair{"a.usda",
                  "#usda 1.0\ndef \"a\" {\n  float inf\n  float[] nan = [1]\n  custom double "
                  "inf.timeSamples = { 0: 1 }\n  double3 nan (\n    inf = 2\n  )\n}\n"},
        {"a.csv", "name,info\nNan,infant\n"}}) {
    SCOPED_TRACE(name);
    std::ofstream(folder / name, std::ios::binary) << text;
    EXPECT_THAT(inspect_path(folder / name).findings, IsEmpty());
  }
}

}  // namespace
}  // namespace atelier::fixtures
