#ifdef ATELIER_HAS_BODYMODEL

#include "apps/export_motion.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "bodymodel/body_archive.h"
#include "bodymodel/gltf_body.h"
#include "bodymodel/motion_bvh.h"
#include "bodymodel/skin_weights.h"
#include "bodymodel/tracked_motion.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTracked = "atelier.tracked";
constexpr const char* kMotion = "atelier-motion-1";

}  // namespace

bool is_motion_result(const fs::path& file) {
  if (file.extension() == ".h5") {
    return archive_contents(file).schema == kTracked;
  }
  return file.extension() == ".npz" && archive_schema(Npz(file)) == kMotion;
}

void export_bvh(const fs::path& file, const fs::path& bvh) {
  MotionClip clip;
  if (file.extension() == ".npz") {
    clip = read_motion(file);
  } else {
    const TrackedMotion tracked = read_tracked_motion(file);
    clip.skeleton = tracked.skeleton;
    clip.motion = tracked.motion;
  }
  clip.name = file.stem().string();
  write_bvh(bvh, clip);
}

GltfScene joined_scenes(GltfScene scene, const GltfScene& other) {
  const auto nodes = static_cast<int>(scene.nodes.size());
  const auto meshes = static_cast<int>(scene.meshes.size());
  const auto skins = static_cast<int>(scene.skins.size());
  const auto moved = [](int index, int by) { return index < 0 ? index : index + by; };
  for (GltfNode node : other.nodes) {
    node.parent = moved(node.parent, nodes);
    node.mesh = moved(node.mesh, meshes);
    node.skin = moved(node.skin, skins);
    scene.nodes.push_back(std::move(node));
  }
  for (const int root : other.roots) {
    scene.roots.push_back(root + nodes);
  }
  scene.meshes.insert(scene.meshes.end(), other.meshes.begin(), other.meshes.end());
  for (GltfSkin skin : other.skins) {
    for (int& joint : skin.joints) {
      joint += nodes;
    }
    scene.skins.push_back(std::move(skin));
  }
  if (scene.animations.empty() && !other.animations.empty()) {
    scene.animations.push_back({other.animations[0].name, {}});
  }
  for (const GltfAnimation& animation : other.animations) {
    for (GltfChannel channel : animation.channels) {
      channel.node += nodes;
      scene.animations[0].channels.push_back(std::move(channel));
    }
  }
  check_gltf(scene);
  return scene;
}

bool is_animation_result(const fs::path& result) {
  return fs::exists(result / "body.npz") && fs::exists(result / "motion.npz");
}

GltfScene avatar_scene(const fs::path& result) {
  BodyModel body = read_body(result / "body.npz");
  const MotionClip clip = read_motion(result / "motion.npz");
  if (clip.skeleton.names != body.skeleton.names) {
    throw DataError((result / "motion.npz").string(), "joints", "those of another body",
                    "the motion of this one; run 'atelier animate' again");
  }
  body.name = "body";
  body.skin = repair_skin_weights(body.skin, joint_count(body), {.max_slots = 4}).skin;
  GltfScene scene = gltf_body(body, {}, clip.motion);
  std::vector<fs::path> garments;
  if (fs::is_directory(result / "garments")) {
    for (const auto& entry : fs::directory_iterator(result / "garments")) {
      garments.push_back(entry.path());
    }
  }
  std::sort(garments.begin(), garments.end());
  for (const fs::path& garment : garments) {
    const Sequence sequence = open_sequence(garment);
    const SequenceHeader header = read_sequence_header(garment);
    std::vector<Mesh> frames;
    for (Index i = 0; i < frame_count(sequence); ++i) {
      frames.push_back(frame(sequence, i));
      frames.back().uvs = header.shared.uvs;
      frames.back().uv_faces = header.shared.uv_faces;
    }
    scene = joined_scenes(std::move(scene),
                          gltf_morph_sequence(frames, sequence.fps, garment.filename().string()));
  }
  return scene;
}

}  // namespace atelier

#endif
