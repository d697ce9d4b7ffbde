#include "core/garment_archive.h"

#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A square tube of eight triangles with a neck and a hem, sewn along one side from two panels.
Garment tube() {
  Garment garment;
  garment.name = "upper";
  Mesh& mesh = garment.mesh;
  mesh.vertices.resize(8, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 1, 1, 0, 1, 1, 1, 0, 1, 1.0 / 3;
  mesh.faces.resize(8, 3);
  mesh.faces << 0, 4, 1, 1, 4, 5, 1, 5, 2, 2, 5, 6, 2, 6, 3, 3, 6, 7, 3, 7, 0, 0, 7, 4;
  mesh.uvs.resize(4, 2);
  mesh.uvs << 0, 0, 1, 0, 1, 1, 0, 1;
  mesh.uv_faces = Triangles::Zero(8, 3);
  garment.rest = mesh.uvs;
  garment.rest_faces = mesh.uv_faces;
  garment.panels = {0, 0, 0, 0, 1, 1, 1, 1};
  garment.panel_names = {"front", "back"};
  garment.seams = {{"left side", {0, 4}, {3, 7}}, {"nothing yet", {}, {}}};
  garment.boundaries = {{4, 5, 6, 7}, {}, {0, 1, 2, 3}};
  garment.boundary_names = {"neck", "cuff left", "hem"};
  garment.attachments = {{0, 17, {0.2, 0.3, 0.5}, 0.01}, {7, 0, {1, 0, 0}, -0.002}};
  garment.material = {"linen", 0.2, 900, 800, 50, 2e-5, 0.01, 0.3, 0.002};
  return garment;
}

std::string garment_archive_refusal(const std::function<void(Archive&)>& change) {
  Archive archive = archive_of(tube());
  change(archive);
  try {
    garment_of(archive, "a.h5");
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(GarmentArchive, WrittenGarment_ReadsBackBitExact) {
  const fixtures::TemporaryDirectory folder;
  const Garment garment = tube();
  write_garment_archive(folder / "upper.h5", garment);
  const Garment again = read_garment_archive(folder / "upper.h5");
  EXPECT_EQ(again.name, garment.name);
  EXPECT_TRUE(equal_arrays(again.mesh.vertices, garment.mesh.vertices));
  EXPECT_TRUE(equal_arrays(again.mesh.faces, garment.mesh.faces));
  EXPECT_TRUE(equal_arrays(again.mesh.uvs, garment.mesh.uvs));
  EXPECT_TRUE(equal_arrays(again.mesh.uv_faces, garment.mesh.uv_faces));
  EXPECT_TRUE(equal_arrays(again.rest, garment.rest));
  EXPECT_TRUE(equal_arrays(again.rest_faces, garment.rest_faces));
  EXPECT_EQ(again.panels, garment.panels);
  EXPECT_EQ(again.panel_names, garment.panel_names);
  ASSERT_EQ(again.seams.size(), 2u);
  EXPECT_EQ(again.seams[0].name, "left side");
  EXPECT_THAT(again.seams[0].a, ElementsAre(0, 4));
  EXPECT_THAT(again.seams[0].b, ElementsAre(3, 7));
  EXPECT_TRUE(again.seams[1].a.empty());
  EXPECT_EQ(again.boundaries, garment.boundaries);
  EXPECT_EQ(again.boundary_names, garment.boundary_names);
  ASSERT_EQ(again.attachments.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again.attachments[i].vertex, garment.attachments[i].vertex);
    EXPECT_EQ(again.attachments[i].triangle, garment.attachments[i].triangle);
    EXPECT_EQ(again.attachments[i].barycentric, garment.attachments[i].barycentric);
    EXPECT_EQ(again.attachments[i].distance, garment.attachments[i].distance);
  }
  EXPECT_EQ(again.material.name, "linen");
  EXPECT_EQ(again.material.bending, garment.material.bending);
  EXPECT_EQ(again.material.thickness, garment.material.thickness);
}

TEST(GarmentArchive, EmptyArrays_AreNotStored) {
  const fixtures::TemporaryDirectory folder;
  Garment garment;
  garment.mesh = tube().mesh;
  garment.mesh.uvs.resize(0, 2);
  garment.mesh.uv_faces.resize(0, 3);
  write_garment_archive(folder / "a.h5", garment);
  EXPECT_EQ(archive_contents(folder / "a.h5").datasets.size(), 3u);
  const Garment again = read_garment_archive(folder / "a.h5");
  EXPECT_TRUE(again.name.empty());
  EXPECT_TRUE(again.attachments.empty());
  EXPECT_TRUE(again.boundaries.empty());
  EXPECT_EQ(again.rest.rows(), 0);
}

TEST(GarmentArchive, InvalidGarment_IsRefusedOnWrite) {
  const fixtures::TemporaryDirectory folder;
  Garment garment = tube();
  garment.boundaries[0][0] = 8;
  EXPECT_THROW(write_garment_archive(folder / "a.h5", garment), DataError);
  garment = tube();
  garment.attachments[1].barycentric[0] = 0.5;
  EXPECT_THROW(write_garment_archive(folder / "a.h5", garment), DataError);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
}

TEST(GarmentArchive, OtherSchemaOrVersion_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  Archive archive = archive_of(tube());
  archive.schema = "atelier.mesh";
  write_archive(folder / "a.h5", archive);
  EXPECT_THROW(read_garment_archive(folder / "a.h5"), DataError);
  archive.schema = "atelier.garment";
  archive.version = 2;
  write_archive(folder / "b.h5", archive);
  EXPECT_THROW(read_garment_archive(folder / "b.h5"), DataError);
}

TEST(GarmentArchive, OtherUnitsAndUnknownArrays_AreRefused) {
  EXPECT_THAT(garment_archive_refusal([](Archive& a) { a.units = "cm"; }),
              HasSubstr("a.h5: units: cm"));
  EXPECT_THAT(garment_archive_refusal([](Archive& a) { a.up_axis = "z"; }), HasSubstr("up z"));
  EXPECT_THAT(garment_archive_refusal(
                  [](Archive& a) { a.datasets["extra"] = tensor_of(std::vector<int>{1}); }),
              HasSubstr("extra: not of this schema"));
  EXPECT_THAT(garment_archive_refusal(
                  [](Archive& a) { a.datasets["cloth/extra"] = tensor_of(std::vector<int>{1}); }),
              HasSubstr("extra: not of this schema"));
}

TEST(GarmentArchive, OutOfRangeIndices_AreRefused) {
  const auto ints = [](std::vector<int> values, std::int64_t columns) {
    const auto rows = static_cast<std::int64_t>(values.size()) / columns;
    return tensor_of(values, {rows, columns});
  };
  EXPECT_THAT(garment_archive_refusal([&](Archive& a) {
                a.datasets["boundaries"] = ints({0, 8}, 2);
              }),
              HasSubstr("index 8"));
  EXPECT_THAT(garment_archive_refusal([&](Archive& a) {
                a.datasets["boundaries"] = ints({3, 1}, 2);
              }),
              HasSubstr("a boundary that has a name"));
  EXPECT_THAT(garment_archive_refusal([&](Archive& a) {
                a.datasets["seams"] = ints({2, 1, 1}, 3);
              }),
              HasSubstr("a seam and two of 8 vertices"));
  EXPECT_THAT(garment_archive_refusal([&](Archive& a) {
                a.datasets["attachments/places"] = ints({8, 0, 0, 0}, 2);
              }),
              HasSubstr("vertex 8"));
  EXPECT_THAT(garment_archive_refusal([&](Archive& a) {
                a.datasets["attachments/places"] = ints({0, 0}, 2);
              }),
              HasSubstr("attachments/coordinates: 2 rows"));
}

}  // namespace
}  // namespace atelier
