#include "core/io/usd_sequence.h"

#include <cctype>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

/// Reads as much of USD's text as a mesh needs, and refuses what is out of place.
class UsdText {
 public:
  explicit UsdText(std::string text) : text_(std::move(text)) {
    EXPECT_EQ(text_.substr(0, 10), "#usda 1.0\n");
    at_ = 10;
    expect("(");
    while (!take(")")) {
      const std::string key = word();
      expect("=");
      layer[key] = word();
    }
    expect("def");
    expect("Xform");
    expect("\"root\"");
    expect("{");
    while (!take("}")) {
      expect("def");
      expect("Mesh");
      prims.emplace_back().name = word();
      expect("{");
      while (!take("}")) {
        property(prims.back());
      }
    }
    skip();
    EXPECT_EQ(at_, text_.size());
  }

  struct Prim {
    std::string name;
    std::map<std::string, std::string> tokens;
    std::map<std::string, std::vector<double>> arrays;
    std::map<int, std::vector<double>> samples;  ///< points
    std::map<int, std::vector<double>> extents;
  };
  std::map<std::string, std::string> layer;
  std::vector<Prim> prims;

 private:
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) {
      ++at_;
    }
  }
  bool take(const std::string& what) {
    skip();
    if (text_.compare(at_, what.size(), what) != 0) {
      return false;
    }
    at_ += what.size();
    return true;
  }
  void expect(const std::string& what) {
    if (!take(what)) {
      throw std::runtime_error("expected " + what + " at " + text_.substr(at_, 20));
    }
  }
  std::string word() {
    skip();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !std::isspace(static_cast<unsigned char>(text_[at_])) &&
           std::string("=()[]{},:").find(text_[at_]) == std::string::npos) {
      ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }
  std::vector<double> numbers() {
    std::vector<double> out;
    expect("[");
    while (!take("]")) {
      const bool tuple = take("(");
      do {
        out.push_back(std::stod(word()));
      } while (tuple && take(","));
      if (tuple) {
        expect(")");
      }
      take(",");
    }
    return out;
  }
  void property(Prim& prim) {
    std::string type = word();
    if (type == "uniform") {
      type = word();
    }
    if (take("[")) {
      expect("]");
    }
    const std::string name = word();
    expect("=");
    if (name.ends_with(".timeSamples")) {
      expect("{");
      while (!take("}")) {
        const int time = std::stoi(word());
        expect(":");
        (name == "points.timeSamples" ? prim.samples : prim.extents)[time] = numbers();
        expect(",");
      }
    } else if (type == "token" || type == "bool") {
      prim.tokens[name] = word();
    } else {
      prim.arrays[name] = numbers();
    }
  }

  std::string text_;
  std::size_t at_ = 0;
};

Sequence two_frames() {
  Mesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 1, 0.1, 0, 1, 1, -1e-7, 0, 1, 12345.678;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3;
  Mesh moved = mesh;
  moved.vertices *= 2;
  return sequence_of({mesh, moved}, 24, {7, 9});
}

TEST(UsdSequence, WrittenSequence_HasUnitsTimesAndPoints) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder.path() / "a.usda";
  const Sequence sequence = two_frames();
  write_usd_sequence(path, sequence, "7 dress!");
  const UsdText usd(read_file_text(path, 1 << 20));
  EXPECT_EQ(usd.layer.at("metersPerUnit"), "1");
  EXPECT_EQ(usd.layer.at("upAxis"), "\"Y\"");
  EXPECT_EQ(usd.layer.at("timeCodesPerSecond"), "24");
  EXPECT_EQ(usd.layer.at("startTimeCode"), "7");
  EXPECT_EQ(usd.layer.at("endTimeCode"), "9");
  ASSERT_EQ(usd.prims.size(), 1U);
  const UsdText::Prim& prim = usd.prims[0];
  EXPECT_EQ(prim.name, "\"__dress_\"");
  EXPECT_EQ(prim.tokens.at("subdivisionScheme"), "\"none\"");
  EXPECT_EQ(prim.arrays.at("faceVertexCounts"), (std::vector<double>{3, 3}));
  EXPECT_EQ(prim.arrays.at("faceVertexIndices"), (std::vector<double>{0, 1, 2, 0, 2, 3}));
  EXPECT_EQ(prim.tokens.at("doubleSided"), "1");
  EXPECT_EQ(prim.arrays.at("points"), prim.samples.at(7)) << "what programs show that play nothing";
  EXPECT_EQ(prim.arrays.at("extent"), prim.extents.at(7));
  EXPECT_EQ(prim.extents.at(7)[1], 0);
  EXPECT_EQ(prim.extents.at(9)[3], 2);
  ASSERT_EQ(prim.samples.size(), 2U);
  for (const int i : {0, 1}) {
    const Points expected = frame(sequence, i).vertices;
    const std::vector<double>& points = prim.samples.at(i == 0 ? 7 : 9);
    ASSERT_EQ(points.size(), 12U);
    for (std::size_t k = 0; k < 12; ++k) {
      const double value = expected(static_cast<Index>(k / 3), static_cast<Index>(k % 3));
      EXPECT_EQ(static_cast<float>(points[k]), static_cast<float>(value));
    }
  }
}

TEST(UsdSequence, SeveralSequences_AreSiblingPrims) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder.path() / "a.usda";
  Sequence earlier = two_frames();
  earlier.frame_ids = {3, 4};
  const std::vector<NamedSequence> both = {{"body", two_frames()}, {"dress", earlier}};
  write_usd_sequences(path, both);
  const UsdText usd(read_file_text(path, 1 << 20));
  ASSERT_EQ(usd.prims.size(), 2U);
  EXPECT_EQ(usd.prims[0].name, "\"body\"");
  EXPECT_EQ(usd.prims[1].name, "\"dress\"");
  EXPECT_EQ(usd.prims[1].samples.begin()->first, 3);
  EXPECT_EQ(usd.prims[0].samples.begin()->first, 7);
  EXPECT_EQ(usd.layer.at("startTimeCode"), "3");
  EXPECT_EQ(usd.layer.at("endTimeCode"), "9");
}

TEST(UsdSequence, IncompatibleSequences_AreRefused) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder.path() / "a.usda";
  std::vector<NamedSequence> both = {{"a b", two_frames()}, {"a_b", two_frames()}};
  EXPECT_THROW(write_usd_sequences(path, both), LogicError) << "one name for both";
  both[1].name = "c";
  both[1].sequence.fps = 30;
  EXPECT_THROW(write_usd_sequences(path, both), LogicError);
  EXPECT_THROW(write_usd_sequences(path, {}), LogicError);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(UsdSequence, SequenceWithoutTopologyOrRate_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder.path() / "a.usda";
  Sequence sequence = two_frames();
  sequence.fps = 0;
  EXPECT_THROW(write_usd_sequence(path, sequence), LogicError);
  sequence = two_frames();
  sequence.faces.resize(0, 3);
  EXPECT_THROW(write_usd_sequence(path, sequence), LogicError);
  sequence = two_frames();
  sequence.load = [](Index) -> Mesh { throw DataError("a.h5", "frame", "damaged", "whole"); };
  EXPECT_THROW(write_usd_sequence(path, sequence), DataError);
  EXPECT_FALSE(std::filesystem::exists(path)) << "half a file is no file";
  EXPECT_THROW(write_usd_sequence(folder.path() / "no" / "a.usda", two_frames()), EnvironmentError);
}

}  // namespace
}  // namespace atelier
