// `inspect` of the hand-made malformed files: each is refused, or has a finding.

#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/inspection.h"
#include "core/archive.h"
#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/io/zip_archive.h"
#include "fuzz/body_arrays.h"
#include "fuzz/forged_archive.h"
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
      // Of another size than the picture that was asked for, or beyond the base mesh, or another
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

TEST_P(InspectMalformed, IsRefusedOrHasAFinding) {
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
                      "csv", "dxf", "easymocap_annotation", "garment", "gltf", "goliath", "html",
                      "human36m", "jpeg", "json", "json_lines", "keypoints3d", "manifest",
                      "materials", "mesh_sequence", "mhclo", "nerfstudio", "npy", "npz", "obj",
                      "openpose", "painted_picture", "painted_scene", "panoptic", "pattern",
                      "personal_body", "ply", "png", "qualisys", "rig", "run_account",
                      "safetensors", "seams", "sequence_header", "simulated_frame", "smpl", "svg",
                      "synthesis_state", "target", "tiff", "toml", "tracked_motion", "training",
                      "trc", "truth", "usda", "webp", "zip"),
    [](const auto& instance) { return instance.param; });

TEST(InspectArchives, AFrameOfTheTruthIsHeldAgainstItsCapture) {
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

TEST(InspectArchives, ASchemaThatIsNotKnownIsSaid) {
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

TEST(InspectArchives, ALaterVersionIsRefused) {
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

TEST(InspectArchives, WhatIsSoundHasNoFinding) {
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

TEST(InspectZip, NamesThatLeadOutAreErrors) {
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

TEST(InspectZip, ADamagedFileInItIsRefused) {
  const TemporaryDirectory folder;
  std::vector<std::byte> bytes = zip_bytes({{"a.txt", std::vector<std::byte>(100)}}, false);
  bytes[60] ^= std::byte{1};  // of the hundred
  write_bytes(folder / "file.zip", bytes);
  EXPECT_THROW(inspect_path(folder / "file.zip"), DataError);
}

TEST(InspectZip, FilesThatAreTooManyTimesTheZipAreRefused) {
  const std::vector<std::byte> zeros(1000);
  const std::vector<std::byte> bytes = zip_bytes({{"a", zeros}, {"b", zeros}}, true);
  Limits limits;
  limits.inflate_free_bytes = 1000;
  limits.inflate_ratio = 2;
  EXPECT_NO_THROW(ZipArchive(bytes, "zip").check());
  EXPECT_THROW(ZipArchive(bytes, "zip", limits).check(), DataError)
      << "each is small enough, not both";
}

TEST(InspectTexts, WhatOthersStillOpenIsAFinding) {
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

TEST(InspectTexts, NamesAreNoNumbers) {
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
