#include "core/store/manifest.h"

#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/store/manifest_limits.h"

namespace atelier {
namespace {

using testing::HasSubstr;

Manifest example() {
  Manifest manifest;
  manifest.stage = "statistics";
  manifest.stage_version = 3;
  manifest.device = "cpu";
  manifest.options = {{"a.gain", "1e+05", "flag", true},
                      {"a.names", "\"x\"", "default", true},
                      {"jobs", "4", "file.toml:3", false}};
  manifest.canonical_options = R"({"a.gain":1e+05,"a.names":"x"})";
  manifest.inputs = {{"meshes", "/data/boxes", sha256("in"), 12, 3456, "", {}, {3, 1u << 20}}};
  manifest.outputs = {{"frames/000000.json", 10, sha256("zero")},
                      {"frames/000001.json", 11, sha256("one")},
                      {"statistics.json", 12, sha256("all")}};
  manifest.consent = {{"P. Doe", "research", "2030-12-31"}};
  manifest.metrics = {{"area", 1.25}, {"frames", 2}};
  manifest.warnings = {"warning odd [a]: \"b\"", "frame 3: c"};
  manifest.build = "atelier test";
  manifest.started = "2026-11-21T10:00:00Z";
  manifest.finished = "2026-11-21T10:00:01Z";
  manifest.work_seconds = 0.75;
  manifest.peak_memory_bytes = 1 << 20;
  manifest.key = stage_key(manifest.stage, manifest.stage_version, manifest.device,
                           manifest.canonical_options, manifest.inputs);
  return manifest;
}

/// The text with something changed and its own digest made right again, so that the check behind
/// the digest is reached.
std::string changed(const std::function<void(nlohmann::json&)>& change) {
  nlohmann::json json = nlohmann::json::parse(manifest_text(example()));
  json.erase("manifest_sha256");
  change(json);
  json["manifest_sha256"] = hex(sha256(json.dump()));
  return json.dump();
}

std::string refusal(const std::string& text) {
  try {
    parse_manifest(text, "manifest.json");
  } catch (const DataError& error) {
    EXPECT_EQ(error.file, "manifest.json");
    return error.what();
  }
  return "it was read";
}

TEST(Manifest, Manifest_RoundTrips) {
  const Manifest manifest = example();
  const Manifest again = parse_manifest(manifest_text(manifest));
  EXPECT_EQ(manifest_text(again), manifest_text(manifest));
  EXPECT_EQ(again.stage, "statistics");
  EXPECT_EQ(again.key, manifest.key);
  EXPECT_EQ(again.outputs.size(), 3u);
  EXPECT_EQ(again.outputs[1].digest, sha256("one"));
  EXPECT_EQ(again.options[2].source, "file.toml:3");
  EXPECT_FALSE(again.options[2].keyed);
  EXPECT_EQ(again.consent, manifest.consent);
  EXPECT_EQ(again.metrics, manifest.metrics);
  EXPECT_EQ(again.warnings, manifest.warnings);
  EXPECT_EQ(again.inputs[0].files, 12);
  EXPECT_EQ(again.inputs[0].sketch, manifest.inputs[0].sketch);
}

TEST(Manifest, ManifestOfVersionOne_IsReadWithoutWarnings) {
  const std::string text = changed([](auto& j) {
    j["schema_version"] = 1;
    j.erase("warnings");
  });
  const Manifest again = parse_manifest(text);
  EXPECT_EQ(again.warnings.size(), 0u);
  EXPECT_EQ(again.metrics, example().metrics);
  EXPECT_THAT(refusal(changed([](auto& j) { j["schema_version"] = 1; })),
              HasSubstr("warnings: an unknown field"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["schema_version"] = 0; })),
              HasSubstr("schema_version: 0"));
}

TEST(Manifest, ManifestOfVersionTwo_IsReadWithoutSketches) {
  const Manifest again = parse_manifest(changed([](auto& j) {
    j["schema_version"] = 2;
    j["inputs"][0].erase("sketch");
  }));
  EXPECT_TRUE(again.inputs[0].sketch.empty());
  EXPECT_EQ(again.warnings, example().warnings);
}

TEST(Manifest, DamagedSketches_AreRefused) {
  for (const std::string& sketch :
       {std::string("12"), std::string(16, 'F'), std::string(32, '0'), std::string(16, 'x'),
        std::string(16, 'f') + std::string(16, '0'), std::string(16 * (kSketchSize + 1), '1')}) {
    EXPECT_THAT(refusal(changed([&](auto& j) { j["inputs"][0]["sketch"] = sketch; })),
                HasSubstr("inputs[0].sketch"));
  }
}

TEST(Manifest, TooManyWarnings_AreRefused) {
  const auto with = [](std::size_t count) {
    return changed([&](auto& j) { j["warnings"] = std::vector<std::string>(count, "w"); });
  };
  EXPECT_EQ(parse_manifest(with(kMaxWarnings)).warnings.size(), kMaxWarnings);
  EXPECT_THAT(refusal(with(kMaxWarnings + 1)), HasSubstr("at most 1000"));
}

TEST(Manifest, Key_DependsOnEachPart) {
  const auto key = [](std::string_view stage, int version, std::string_view device,
                      std::string_view options, const std::string& input, const std::string& kind) {
    return hex(stage_key(stage, version, device, options, {{kind, "p", sha256(input), 1, 1, ""}}));
  };
  const std::string base = key("a", 1, "cpu", "{}", "i", "k");
  EXPECT_EQ(base, key("a", 1, "cpu", "{}", "i", "k"));
  EXPECT_NE(base, key("b", 1, "cpu", "{}", "i", "k"));
  EXPECT_NE(base, key("a", 2, "cpu", "{}", "i", "k"));
  EXPECT_NE(base, key("a", 1, "cuda", "{}", "i", "k"));
  EXPECT_NE(base, key("a", 1, "cpu", "{\"x\":1}", "i", "k"));
  EXPECT_NE(base, key("a", 1, "cpu", "{}", "j", "k"));
  EXPECT_NE(base, key("a", 1, "cpu", "{}", "i", "l"));
}

TEST(Manifest, KeyParts_CannotRunTogether) {
  EXPECT_NE(stage_key("ab", 1, "", "", {}), stage_key("a", 1, "", "b", {}));
  EXPECT_NE(stage_key("a", 11, "", "", {}), stage_key("a", 1, "1", "", {}));
}

TEST(Manifest, Key_IgnoresInputLocation) {
  EXPECT_EQ(stage_key("a", 1, "", "{}", {{"k", "/here", sha256("i"), 1, 1, ""}}),
            stage_key("a", 1, "", "{}", {{"k", "/there", sha256("i"), 1, 1, "s"}}));
}

TEST(Manifest, OutputsDigest_DependsOnNamesAndBytes) {
  Manifest manifest = example();
  const Digest digest = outputs_digest(manifest);
  manifest.finished = "2026-11-21T10:00:09Z";
  EXPECT_EQ(outputs_digest(manifest), digest);
  manifest.outputs[0].digest = sha256("other");
  EXPECT_NE(outputs_digest(manifest), digest);
  manifest = example();
  manifest.outputs[2].path = "t.json";
  EXPECT_NE(outputs_digest(manifest), digest);
}

TEST(Manifest, NonFiniteMetric_IsRefused) {
  Manifest manifest = example();
  manifest.metrics["area"] = std::nan("");
  EXPECT_THROW(manifest_text(manifest), LogicError);
}

TEST(Manifest, Truncation_IsRefused) {
  const std::string text = manifest_text(example());
  for (std::size_t size = 0; size + 2 < text.size(); ++size) {
    ASSERT_THROW(parse_manifest(text.substr(0, size)), DataError) << size;
  }
}

TEST(Manifest, FlippedBit_IsRefused) {
  const std::string text = manifest_text(example());
  const nlohmann::json good = nlohmann::json::parse(text);
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = text;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      if (nlohmann::json::parse(damaged, nullptr, false) == good) {
        continue;  // blanks
      }
      ASSERT_THROW(parse_manifest(damaged), DataError) << "byte " << i << " bit " << bit;
    }
  }
}

TEST(Manifest, ChangedContent_IsRefused) {
  std::string text = manifest_text(example());
  text.replace(text.find("\"area\": 1.25"), 12, "\"area\": 1.26");
  EXPECT_THAT(refusal(text), HasSubstr("another digest than that of the content"));
}

TEST(Manifest, OtherSchema_IsRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["schema"] = "something"; })),
              HasSubstr("schema: 'something'; expected atelier-manifest"));
}

TEST(Manifest, NewerSchemaVersion_IsRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["schema_version"] = 5; })),
              HasSubstr("a newer atelier wrote it"));
}

TEST(Manifest, StaleKey_IsRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["stage_version"] = 4; })), HasSubstr("another key"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["device"] = "cuda"; })), HasSubstr("another key"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["key"] = std::string(64, '0'); })),
              HasSubstr("another key"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["inputs"][0]["digest"] = std::string(64, 'a'); })),
              HasSubstr("another key"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["inputs"] = nlohmann::json::array(); })),
              HasSubstr("another key"));
}

TEST(Manifest, OptionsNotMatchingKey_AreRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["options"][0]["value"] = 5; })),
              HasSubstr("canonical_options: other values than under options"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["options"][0]["keyed"] = false; })),
              HasSubstr("canonical_options"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["canonical_options"] = "{"; })), HasSubstr("JSON"));
}

TEST(Manifest, DuplicateOptionOrOutput_IsRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["options"].push_back(j["options"][0]); })),
              HasSubstr("each option once"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["outputs"][1]["path"] = "frames/000000.json"; })),
              HasSubstr("each output once"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["outputs"][1]["path"] = "Frames/000000.JSON"; })),
              HasSubstr("letter case aside"));
}

TEST(Manifest, UnsortedOutputs_AreRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { std::swap(j["outputs"][0], j["outputs"][1]); })),
              HasSubstr("sorted by path"));
}

TEST(Manifest, ManifestAsOwnOutput_IsRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["outputs"][1]["path"] = "manifest.json"; })),
              HasSubstr("the manifest itself"));
}

class UnsafePath : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(All, UnsafePath,
                         testing::Values("", "/etc/passwd", "../x", "a/../../b", "a/..", "./a",
                                         "a//b", "a/", "/", ".hidden", "a/.hidden", "a.", "a/b.",
                                         "a b", "a\\b", "a\nb", "ä", "a:b", "~/x", "a*", "-/$x",
                                         "C:/x", "..."));

TEST_P(UnsafePath, UnsafeOutputPath_IsRefused) {
  EXPECT_FALSE(is_safe_output_path(GetParam()));
  const std::string message =
      refusal(changed([](auto& j) { j["outputs"][0]["path"] = GetParam(); }));
  EXPECT_THAT(message, HasSubstr("outputs[0].path"));
}

TEST(Manifest, OverlongPath_IsRefused) {
  EXPECT_FALSE(is_safe_output_path(std::string(201, 'a')));
  EXPECT_TRUE(is_safe_output_path(std::string(200, 'a')));
  std::string deep = "a";
  while (deep.size() < 1030) {
    deep += "/a";
  }
  EXPECT_FALSE(is_safe_output_path(deep));
  EXPECT_FALSE(is_safe_output_path(std::string(4096, 'a')));
  EXPECT_FALSE(is_safe_output_path(std::string("a\0b", 3)));
}

TEST(Manifest, OrdinaryPaths_AreAccepted) {
  for (const char* path : {"a", "a/b/c.json", "frames/000012.h5", "A-b_c.1.ply", "a..b"}) {
    EXPECT_TRUE(is_safe_output_path(path)) << path;
  }
}

struct BadField {
  const char* name;
  const char* json;
};

class WrongField : public testing::TestWithParam<BadField> {};

INSTANTIATE_TEST_SUITE_P(
    All, WrongField,
    testing::Values(
        BadField{"stage", "5"}, BadField{"stage", "null"}, BadField{"stage", "\"a\\nb\""},
        BadField{"stage_version", "-1"}, BadField{"stage_version", "1.5"},
        BadField{"stage_version", "\"1\""}, BadField{"stage_version", "2147483648"},
        BadField{"stage_version", "9223372036854775808"},
        BadField{"stage_version", "18446744073709551615"}, BadField{"key", "\"00\""},
        BadField{"key", "\"zz\""}, BadField{"key", "7"}, BadField{"options", "{}"},
        BadField{"options", "[1]"}, BadField{"options", "[{}]"}, BadField{"inputs", "null"},
        BadField{"inputs", "[[]]"}, BadField{"outputs", "\"x\""}, BadField{"outputs", "[null]"},
        BadField{"metrics", "[]"}, BadField{"metrics", "{\"a\":\"b\"}"},
        BadField{"metrics", "{\"a\":null}"}, BadField{"warnings", "{}"},
        BadField{"warnings", "[1]"}, BadField{"warnings", "[\"a\\u001b[2J\"]"},
        BadField{"consent", "{}"},
        BadField{"consent", "[{\"who\":1,\"scope\":\"\",\"until\":\"\"}]"},
        BadField{"work_seconds", "\"1\""}, BadField{"peak_memory_bytes", "-5"},
        BadField{"peak_memory_bytes", "1e3"}, BadField{"build", "[]"}, BadField{"finished", "0"},
        BadField{"device", "{}"}, BadField{"schema_version", "1.0"}, BadField{"schema", "[]"}));

TEST_P(WrongField, WrongValue_IsRefusedByFieldName) {
  const std::string text =
      changed([](auto& j) { j[GetParam().name] = nlohmann::json::parse(GetParam().json); });
  EXPECT_THAT(refusal(text), HasSubstr(GetParam().name));
}

class MissingField : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(All, MissingField,
                         testing::Values("schema", "schema_version", "stage", "stage_version",
                                         "device", "key", "options", "canonical_options", "inputs",
                                         "outputs", "consent", "metrics", "warnings", "build",
                                         "started", "finished", "work_seconds",
                                         "peak_memory_bytes"));

TEST_P(MissingField, AbsentField_IsRefusedByName) {
  EXPECT_THAT(refusal(changed([](auto& j) { j.erase(GetParam()); })),
              HasSubstr(std::string(GetParam()) + ": nothing; expected this field"));
}

TEST(Manifest, HalfMillionOutputs_RoundTrip) {
  Manifest manifest = example();
  manifest.outputs.clear();
  constexpr int kOutputs = 500'000;
  for (int i = 0; i < kOutputs; ++i) {
    char path[40];
    std::snprintf(path, sizeof path, "garments/upper/%07d.h5", i);
    manifest.outputs.push_back({path, i, sha256(path)});
  }
  const std::string text = manifest_text(manifest);
  EXPECT_GT(text.size(), static_cast<std::size_t>(Limits{}.text_file_bytes));
  const Manifest again = parse_manifest(text, "", manifest_limits());
  ASSERT_EQ(again.outputs.size(), manifest.outputs.size());
  EXPECT_EQ(outputs_digest(again), outputs_digest(manifest));
}

TEST(Manifest, MaximumOutputs_FitTheTextLimits) {
  Manifest manifest = example();
  const std::size_t some = manifest_text(manifest).size();
  manifest.outputs.push_back(
      {"statistics.of.a.garment/with-a-long-name/frames/1000000.json", 1LL << 40, sha256("more")});
  const auto one = static_cast<std::int64_t>(manifest_text(manifest).size() - some);
  const Limits limits = manifest_limits();
  EXPECT_LT(one * kMaxFiles, limits.text_file_bytes);
  EXPECT_LT(4 * kMaxFiles, limits.text_values);
}

TEST(Manifest, UnknownFields_AreRefused) {
  EXPECT_THAT(refusal(changed([](auto& j) { j["extra"] = 1; })),
              HasSubstr("extra: an unknown field"));
  EXPECT_THAT(refusal(changed([](auto& j) { j["outputs"][2]["mode"] = 1; })),
              HasSubstr("outputs[2].mode: an unknown field"));
}

TEST(Manifest, OutputSizeOutOfRange_IsRefused) {
  for (const char* size : {"-1", "1.5", "9223372036854775807", "18446744073709551615"}) {
    EXPECT_THAT(
        refusal(changed([&](auto& j) { j["outputs"][0]["size"] = nlohmann::json::parse(size); })),
        HasSubstr("outputs[0].size"));
  }
}

TEST(Manifest, NonJsonText_IsRefused) {
  for (const char* text : {"", "{", "[]", "null", "5", "\"manifest\"", "{\"schema\":1,}", "{}x",
                           "{\"a\":NaN}", "{\"a\":1e999}", "\xff"}) {
    EXPECT_NE(refusal(text), "it was read") << text;
  }
  EXPECT_NE(refusal(std::string(1000, '[')), "it was read");
}

TEST(Manifest, FolderName_IsTheKeyPrefix) {
  EXPECT_EQ(folder_name(sha256("abc")), "ba7816bf8f01cfea");
}

TEST(Consent, Consent_IsFormattedAsText) {
  EXPECT_EQ(to_string(std::vector<Consent>{}), "none recorded");
  EXPECT_EQ(to_string(example().consent), "P. Doe, research, until 2030-12-31");
  EXPECT_EQ(to_string(std::vector<Consent>{{"A", "all", ""}, {"B", "demo", "2027-01-01"}}),
            "A, all; B, demo, until 2027-01-01");
}

}  // namespace
}  // namespace atelier
