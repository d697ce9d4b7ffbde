// What a page gets of meshes: coordinates in 16 bits, differences, rest shapes; and who gets it.

#include "pipeline/view/view_data.h"

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "core/error.h"
#include "pipeline/view/view_address.h"
#include "pipeline/view/view_marks.h"
#include "pipeline/view/view_place.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

Points random_points(Index count, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> place(-size, size);
  return Points::NullaryExpr(count, 3, [&] { return place(generator); });
}

/// What the page makes of a script: its arrays by name, back from base64 and deflate.
std::string unpacked(const std::string& script) {
  const std::size_t end = script.rfind('"');
  const std::size_t begin = script.rfind('"', end - 1) + 1;
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : script.substr(begin, end - begin)) {
    const std::string_view digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    if (c == '=') {
      break;
    }
    bits = bits << 6U | static_cast<std::uint32_t>(digits.find(c));
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(bits >> static_cast<unsigned>(count) & 0xffU);
    }
  }
  std::string out(1U << 24U, '\0');
  uLongf size = out.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &size,
                       reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
            Z_OK);
  out.resize(size);
  return out;
}

TEST(ViewData, QuantizedVertices_AreWithinHalfAStep) {
  const std::vector<Points> frames = {random_points(500, 1, 1), random_points(500, 1.3, 2)};
  const QuantizedFrames quantized = quantize(frames);
  EXPECT_LT(quantized.step, 2.7 / 65535);
  std::size_t at = 0;
  for (const Points& frame : frames) {
    for (Index v = 0; v < frame.rows(); ++v) {
      for (Index k = 0; k < 3; ++k, ++at) {
        EXPECT_NEAR(quantized.low[k] + quantized.step * quantized.values[at], frame(v, k),
                    0.5001 * quantized.step);
      }
    }
  }
}

TEST(ViewData, Vertices_ComeBackFromTheScriptToTheBit) {
  const std::vector<Points> frames = {random_points(70, 1, 3), random_points(70, 1, 4),
                                      random_points(70, 1, 5)};
  const QuantizedFrames quantized = quantize(frames);
  ViewData data;
  add_vertices(data, quantized);
  const std::string bytes = unpacked(data.script("data/0/1"));
  const std::size_t count = quantized.values.size();
  const auto array = [&](const std::string& name) {
    for (const auto& one : data.header["arrays"]) {
      if (one["name"] == name) {
        EXPECT_EQ(one["count"], count);
        return bytes.substr(one["offset"], count);
      }
    }
    ADD_FAILURE() << name;
    return std::string();
  };
  const std::string small = array("small");
  const std::string large = array("large");
  std::vector<std::uint16_t> decoded(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto coded = static_cast<std::uint32_t>(static_cast<std::uint8_t>(small[i]) |
                                                  static_cast<std::uint8_t>(large[i]) << 8);
    const std::uint32_t difference = (coded >> 1U) ^ (~(coded & 1U) + 1U);
    const auto before = [&](std::size_t k) { return k < 210 ? 0U : decoded[k - 210]; };
    const std::uint32_t beside = i % 210 < 3 ? 0U : decoded[i - 3] - before(i - 3);
    decoded[i] = static_cast<std::uint16_t>(before(i) + beside + difference);
  }
  EXPECT_EQ(decoded, quantized.values);
}

TEST(ViewData, VerticesThatMoveAlike_TakeLittle) {
  std::vector<Points> frames = {random_points(2000, 1, 6)};
  frames.push_back(frames.front().rowwise() + Eigen::RowVector3d(0.01, -0.02, 0.03));
  ViewData one;
  add_vertices(one, quantize(std::span(frames).first(1)));
  ViewData two;
  add_vertices(two, quantize(frames));
  EXPECT_LT(two.script("0").size(), 1.2 * static_cast<double>(one.script("0").size()));
}

TEST(ViewData, PlanesAndPoints_AreQuantizedToo) {
  Points flat = Points::Zero(4, 3);
  flat(1, 0) = 2;
  EXPECT_EQ(quantize(std::span(&flat, 1)).values[3], 65535);
  const Points point = Points::Constant(3, 3, 0.7);
  EXPECT_THAT(quantize(std::span(&point, 1)).values, Each(0));
  EXPECT_TRUE(quantize({}).values.empty());
}

TEST(ViewData, VerticesThatCannotBe_AreRefused) {
  std::vector<Points> frames = {Points::Zero(3, 3), Points::Zero(4, 3)};
  EXPECT_THROW(quantize(frames), LogicError);
  frames = {Points::Constant(3, 3, std::nan(""))};
  EXPECT_THROW(quantize(frames), LogicError);
}

TEST(ViewData, InverseRestEdges_GiveTheStrainOfAStretch) {
  Points rest(3, 3);
  rest << 0, 0, 0, 0.1, 0, 0.02, 0.03, 0.08, 0;
  Triangles faces(2, 3);
  faces << 0, 1, 2, 0, 0, 1;
  const std::vector<float> inverse = inverse_rest_edges(rest, faces);
  const Eigen::Matrix2d of_rest =
      (Eigen::Matrix2d() << inverse[0], inverse[1], inverse[2], inverse[3]).finished();
  Eigen::Matrix<double, 3, 2> edges;
  edges << 1.25 * (rest.row(1) - rest.row(0)).transpose(),
      1.25 * (rest.row(2) - rest.row(0)).transpose();
  const Eigen::Vector2d stretches = (edges * of_rest).jacobiSvd().singularValues();
  EXPECT_NEAR(stretches[0], 1.25, 1e-5);
  EXPECT_NEAR(stretches[1], 1.25, 1e-5);
  EXPECT_THAT(std::vector<float>(inverse.begin() + 4, inverse.end()), Each(0));  // no area
}

TEST(ViewData, NumbersBeyondTheLegend_AreItsEnds) {
  const std::vector<double> values = {-1, 0, 0.5, 1, 2};
  EXPECT_EQ(to_bytes(values, 0, 1), (std::vector<std::uint8_t>{0, 0, 128, 255, 255}));
}

TEST(ViewData, KeysAndNames_AreNoScript) {
  ViewData data;
  data.header["why"] = "\"</script>\xff\\";
  const std::string script = data.script("data/0");
  EXPECT_THAT(script, HasSubstr(R"("\"</script>)"));
  EXPECT_EQ(script.find('\xff'), std::string::npos);
}

TEST(ViewData, PlacesInTexts_AreThoseInsideTheRootsOrNamesAlone) {
  const std::vector<std::string> roots = {"/home/p doe/work", "work"};
  const auto said = [&](const std::string& text) { return without_folders(text, roots); };
  EXPECT_EQ(said("error output-size [/home/p doe/work/animate/current/a.mp4]: 3 bytes"),
            "error output-size [animate/current/a.mp4]: 3 bytes");
  EXPECT_EQ(said("\"/data/x/cameras.json\" and /data/y/: 3 m/s, 1 / 2"),
            "\"cameras.json\" and y/: 3 m/s, 1 / 2");
  EXPECT_EQ(said("work/body/a.h5; network/body; https://example.org/a/b"),
            "body/a.h5; network/body; https://example.org/a/b");
  EXPECT_EQ(said("/"), "/");
}

TEST(ViewAddress, Token_OpensTheFilesOfThePageAlone) {
  const std::string token = "0123456789abcdef";
  EXPECT_EQ(page_file_of("/" + token + "/", token), "index.html");
  EXPECT_EQ(page_file_of("/" + token + "/data/0/1.js", token), "data/0/1.js");
  for (const std::string path :
       {"/", "", "//", "/index.html", "/0123456789abcdee/", "/0123456789abcde/",
        "/0123456789abcdef", "/0123456789abcdef0/", "/0123456789ABCDEF/", "0123456789abcdef/",
        "/0123456789abcdef/../x", "/0123456789abcdef/data/../../etc/passwd",
        "/0123456789abcdef/.hidden", "/0123456789abcdef//etc/passwd", "/0123456789abcdef/a b",
        "/0123456789abcdef/a\\b", "/0123456789abcdef/%2e%2e/x", "/x/0123456789abcdef/"}) {
    EXPECT_EQ(page_file_of(path, token), std::nullopt) << path;
  }
  EXPECT_EQ(page_file_of("//", ""), std::nullopt) << "no token, no page";
}

TEST(ViewMark, Findings_LeadToTheirFrameAndCamera) {
  const std::vector<int> frames = {3, 7, 12};
  const std::vector<std::string> cameras = {"cam3", "07", "12"};
  const auto mark = [&](const std::string& text) {
    return mark_of(Severity::Warning, text, "validate", frames, cameras);
  };
  EXPECT_EQ(mark("camera-off [cam3]: it is off").camera, "cam3");
  EXPECT_EQ(mark("camera-off [07]: it is off").camera, "07");
  EXPECT_EQ(mark("error image-damaged [images/07/000012.png]: torn").frame_id, 12);
  EXPECT_EQ(mark("error image-damaged [images/07/000012.png]: torn").camera, "07");
  EXPECT_EQ(mark("frame 7 has no scan").frame_id, 7);
  EXPECT_EQ(mark("frame 7 has no scan").camera, "");
  EXPECT_EQ(mark("12 of 12 frames").frame_id, std::nullopt);
  EXPECT_EQ(mark("12 of 12 frames").camera, "");
  EXPECT_EQ(mark("frame 99 is elsewhere").frame_id, std::nullopt);
}

TEST(ViewPlace, WhatIsNothingToSee_IsRefusedWithAHint) {
  const TemporaryDirectory root;
  const auto refusal = [&](const std::filesystem::path& place) {
    try {
      view_kind(place, {});
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string("taken");
  };
  EXPECT_THAT(refusal(root.path() / "nowhere"), HasSubstr("nothing is there"));
  EXPECT_THAT(refusal(root.path()), HasSubstr("an empty folder"));
  std::ofstream(root.path() / "notes.txt") << "x";
  EXPECT_THAT(refusal(root.path() / "notes.txt"), HasSubstr("a workspace, a capture"));
}

}  // namespace
}  // namespace atelier::fixtures
