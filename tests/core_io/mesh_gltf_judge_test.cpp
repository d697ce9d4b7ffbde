// An outside judge: what tinygltf reads of the same files, ours and others'.

#include <cstring>
#include <string>

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include "core/io/file_bytes.h"
#include "core/io/mesh_gltf.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

bool no_image(tinygltf::Image*, const int, std::string*, std::string*, int, int,
              const unsigned char*, int, void*) {
  return true;
}

tinygltf::Model model_of(const std::filesystem::path& path) {
  tinygltf::TinyGLTF reader;
  reader.SetImageLoader(no_image, nullptr);
  tinygltf::Model model;
  std::string error;
  std::string warning;
  const bool good = path.extension() == ".glb"
                        ? reader.LoadBinaryFromFile(&model, &error, &warning, path.string())
                        : reader.LoadASCIIFromFile(&model, &error, &warning, path.string());
  EXPECT_TRUE(good) << error;
  return model;
}

float float_at(const tinygltf::Model& model, const tinygltf::Accessor& accessor, std::size_t row,
               int component) {
  const tinygltf::BufferView& view = model.bufferViews[accessor.bufferView];
  const unsigned char* at = model.buffers[view.buffer].data.data() + view.byteOffset +
                            accessor.byteOffset + row * accessor.ByteStride(view) + 4 * component;
  float value = 0;
  std::memcpy(&value, at, sizeof value);
  return value;
}

void expect_same(const GltfScene& scene, const tinygltf::Model& model, const std::string& file) {
  ASSERT_EQ(scene.nodes.size(), model.nodes.size()) << file;
  ASSERT_EQ(scene.meshes.size(), model.meshes.size()) << file;
  ASSERT_EQ(scene.skins.size(), model.skins.size()) << file;
  ASSERT_EQ(scene.animations.size(), model.animations.size()) << file;
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    EXPECT_EQ(scene.nodes[n].name, model.nodes[n].name);
    for (const int child : model.nodes[n].children) {
      EXPECT_EQ(scene.nodes[child].parent, static_cast<int>(n));
    }
  }
  for (std::size_t m = 0; m < model.meshes.size(); ++m) {
    ASSERT_EQ(scene.meshes[m].primitives.size(), model.meshes[m].primitives.size());
    for (std::size_t p = 0; p < model.meshes[m].primitives.size(); ++p) {
      const tinygltf::Primitive& theirs = model.meshes[m].primitives[p];
      const GltfPrimitive& ours = scene.meshes[m].primitives[p];
      const tinygltf::Accessor& positions = model.accessors[theirs.attributes.at("POSITION")];
      ASSERT_EQ(static_cast<std::size_t>(ours.mesh.vertices.rows()), positions.count);
      for (std::size_t v = 0; v < positions.count; ++v) {
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_EQ(static_cast<float>(ours.mesh.vertices(static_cast<Index>(v), axis)),
                    float_at(model, positions, v, axis));
        }
      }
      EXPECT_EQ(ours.targets.size(), theirs.targets.size());
      if (theirs.indices >= 0) {
        EXPECT_EQ(static_cast<std::size_t>(3 * ours.mesh.faces.rows()),
                  model.accessors[theirs.indices].count);
      }
    }
  }
  for (std::size_t a = 0; a < model.animations.size(); ++a) {
    EXPECT_EQ(scene.animations[a].name, model.animations[a].name);
    ASSERT_EQ(scene.animations[a].channels.size(), model.animations[a].channels.size());
    for (std::size_t c = 0; c < model.animations[a].channels.size(); ++c) {
      const auto& channel = model.animations[a].channels[c];
      const auto& times = model.accessors[model.animations[a].samplers[channel.sampler].input];
      const GltfChannel& ours = scene.animations[a].channels[c];
      EXPECT_EQ(ours.node, channel.target_node);
      ASSERT_EQ(ours.times.size(), times.count);
      EXPECT_EQ(static_cast<float>(ours.times.back()), float_at(model, times, times.count - 1, 0));
    }
  }
}

TEST(GltfJudge, Texture_IsEmbeddedUnchanged) {
  GltfScene scene = gltf_scene(fixtures::tetrahedron());
  scene.meshes[0].primitives[0].material = "cloth";
  GltfMaterial look{"cloth", {0.5, 0.25, 1}, {}};
  for (const char c : std::string("not decoded")) {
    look.texture.push_back(static_cast<std::byte>(c));
  }
  scene.materials = {{"unused", {1, 1, 1}, {}}, look};
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"a.glb", "a.gltf"}) {
    write_gltf(folder.path() / name, scene);
    tinygltf::TinyGLTF reader;
    std::string image;
    reader.SetImageLoader(
        [](tinygltf::Image*, const int, std::string*, std::string*, int, int,
           const unsigned char* bytes, int count, void* text) {
          static_cast<std::string*>(text)->assign(reinterpret_cast<const char*>(bytes),
                                                  static_cast<std::size_t>(count));
          return true;
        },
        &image);
    tinygltf::Model model;
    std::string error;
    std::string warning;
    const std::string path = (folder.path() / name).string();
    ASSERT_TRUE(path.ends_with(".glb") ? reader.LoadBinaryFromFile(&model, &error, &warning, path)
                                       : reader.LoadASCIIFromFile(&model, &error, &warning, path))
        << error;
    ASSERT_EQ(model.materials.size(), 1U);
    const tinygltf::PbrMetallicRoughness& surface = model.materials[0].pbrMetallicRoughness;
    EXPECT_EQ(surface.baseColorFactor, (std::vector<double>{0.5, 0.25, 1, 1}));
    ASSERT_EQ(surface.baseColorTexture.index, 0);
    EXPECT_EQ(model.images.at(model.textures.at(0).source).mimeType, "image/png");
    EXPECT_EQ(image, "not decoded");
    EXPECT_EQ(read_gltf(folder.path() / name).meshes[0].primitives[0].material, "cloth");
  }
}

TEST(GltfJudge, RealFiles_ReadAsTinygltfReadsThem) {
  for (const char* file :
       {"assimp_AnimatedMorphSphere/glTF/AnimatedMorphSphere.gltf",
        "assimp_MorphStressTest/glTF/MorphStressTest.gltf", "assimp_simple_skin/quad_skin.glb",
        "assimp_simple_skin/simple_skin.gltf", "bevy_fox/Fox.glb", "mesh2motion/human-female.glb",
        "mesh2motion/m2m-custom-animation-success.glb", "mesh2motion/rig-human.glb"}) {
    ATELIER_TEST_FILE(path, std::string("gltf_skinned/") + file);
    expect_same(read_gltf(path), model_of(path), file);
  }
}

TEST(GltfJudge, WrittenGlb_IsReadByTinygltf) {
  ATELIER_TEST_FILE(path, "gltf_skinned/mesh2motion/m2m-custom-animation-success.glb");
  const std::string file = glb_bytes(read_gltf(path));
  tinygltf::TinyGLTF reader;
  reader.SetImageLoader(no_image, nullptr);
  tinygltf::Model model;
  std::string error;
  std::string warning;
  ASSERT_TRUE(reader.LoadBinaryFromMemory(&model, &error, &warning,
                                          reinterpret_cast<const unsigned char*>(file.data()),
                                          static_cast<unsigned>(file.size())))
      << error;
  EXPECT_EQ(warning, "");
  expect_same(read_gltf(std::as_bytes(std::span(file)), "ours"), model, "ours");
}

}  // namespace
}  // namespace atelier
