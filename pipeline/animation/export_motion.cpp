#include "pipeline/animation/export_motion.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "appearance/appearance_model.h"
#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/formats/skin_weights.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/unpose.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/normals.h"
#include "core/sequence_archive.h"
#include "pipeline/avatar/avatar_drawing.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTracked = "atelier.tracked";
constexpr const char* kMotion = "atelier-motion-1";

MotionClip motion_of_result(const fs::path& file) {
  MotionClip clip;
  if (file.extension() == ".npz") {
    clip = read_motion(file);
  } else {
    const TrackedMotion tracked = read_tracked_motion(file);
    clip.skeleton = tracked.skeleton;
    clip.motion = tracked.motion;
  }
  clip.name = file.stem().string();
  return clip;
}

}  // namespace

bool is_motion_result(const fs::path& file) {
  if (file.extension() == ".h5") {
    return archive_contents(file).schema == kTracked;
  }
  return file.extension() == ".npz" && archive_schema(Npz(file)) == kMotion;
}

void export_bvh(const fs::path& file, const fs::path& bvh) {
  write_bvh(bvh, motion_of_result(file));
}

void export_trc(const fs::path& file, const fs::path& trc) {
  write_trc(trc, joint_markers(motion_of_result(file)));
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
  scene.materials.insert(scene.materials.end(), other.materials.begin(), other.materials.end());
  scene.findings.insert(scene.findings.end(), other.findings.begin(), other.findings.end());
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

namespace {

std::vector<fs::path> garments_of(const fs::path& result) {
  std::vector<fs::path> garments;
  if (fs::is_directory(result / "garments")) {
    for (const auto& entry : fs::directory_iterator(result / "garments")) {
      garments.push_back(entry.path());
    }
  }
  std::sort(garments.begin(), garments.end());
  return garments;
}

/// The material of skin in the images of animate, roughly that of any person.
GltfMaterial skin_material() {
  return {"skin", {0.62, 0.45, 0.36}, {}};
}

/// The surfaces of the body: as it is seen, where there is an avatar.
fs::path seen_body(const fs::path& result) {
  return fs::is_directory(result / "seen") ? result / "seen" : result / "body";
}

/// An image as a material's texture.
void put_texture(GltfMaterial& material, const Image& texture) {
  const std::string png = image_bytes(texture, ImageFormat::Png);
  const auto* bytes = reinterpret_cast<const std::byte*>(png.data());
  material.texture.assign(bytes, bytes + png.size());
  material.color.setOnes();
}

/// The mean texture of an avatar.
GltfMaterial textured_skin(const fs::path& avatar) {
  GltfMaterial material = skin_material();
  put_texture(material, avatar_model_at(avatar / "body" / "model.safetensors").static_texture);
  return material;
}

/// A garment's best texture that does not change; one colour where none was learnt of this mesh.
/// Takes the mesh's texture coordinates from there.
GltfMaterial cloth_material(const std::string& garment, const fs::path& networks, Mesh& mesh) {
  GltfMaterial material{garment, {0.14, 0.22, 0.42}, {}};
  const fs::path file = networks / garment / "model.safetensors";
  if (networks.empty() || !fs::exists(file)) {
    return material;
  }
  const Safetensors found = read_safetensors(file);
  const AppearanceModel model = appearance_model_of(found.tensors, found.metadata, file.string());
  if (model.faces != mesh.faces) {
    return material;
  }
  mesh.uvs = model.uvs;
  mesh.uv_faces = model.uv_faces;
  put_texture(material, model.static_texture);
  return material;
}

/// Offsets of the surface of each frame from the skin that the joints move (soft tissue, residuals
/// of tracking), as morph targets: these apply before the skin does. Without them cloth that was
/// simulated on those surfaces would be pierced.
void add_surfaces(GltfScene& scene, const BodyModel& body, const MotionClip& clip,
                  const Sequence& surfaces) {
  constexpr double kLeast = 1e-4;  // m, below which skin is where it should be
  const std::vector<Pose>& poses = clip.motion.poses;
  const auto count = static_cast<Index>(poses.size());
  GltfPrimitive& primitive = scene.meshes.at(0).primitives.at(0);
  if (frame_count(surfaces) != count ||
      primitive.mesh.vertices.rows() != body.mesh.vertices.rows()) {
    return;
  }
  const ShapedBody shaped = shape_body(body);
  std::vector<Points> rest;
  std::vector<Points> normals;
  double most = 0;
  for (Index i = 0; i < count; ++i) {
    rest.push_back(unposed_vertices(body, shaped, poses[static_cast<std::size_t>(i)],
                                    frame(surfaces, i).vertices));
    normals.push_back(vertex_normals(rest.back(), primitive.mesh.faces));
    most = std::max(most, (rest.back() - shaped.vertices).cwiseAbs().maxCoeff());
  }
  if (most < kLeast) {
    return;
  }
  primitive.mesh.vertices = rest.front();
  primitive.mesh.normals = normals.front();
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    if (scene.nodes[n].mesh == 0) {
      add_gltf_morphs(scene, static_cast<int>(n), gltf_morphs(rest, normals), clip.motion.fps);
      return;
    }
  }
}

}  // namespace

bool is_animation_result(const fs::path& result) {
  return fs::exists(result / "body.npz") && fs::exists(result / "motion.npz");
}

AvatarLooks looks_of(const Manifest& manifest, const fs::path& workspace) {
  AvatarLooks looks;
  for (const ManifestInput& input : manifest.inputs) {
    const fs::path result = workspace / input.stage / fs::path(input.path).filename();
    if (input.kind == "networks") {
      looks.networks = result;
    } else if (input.kind == "avatar") {
      looks.avatar = result;
    }
  }
  return looks;
}

GltfScene avatar_scene(const fs::path& result, const AvatarLooks& looks) {
  BodyModel body = read_body(result / "body.npz");
  const MotionClip clip = read_motion(result / "motion.npz");
  if (clip.skeleton.names != body.skeleton.names) {
    throw DataError((result / "motion.npz").string(), "joints", "those of another body",
                    "the motion of this one; run 'atelier animate' again");
  }
  body.name = "body";
  // As it is written, so that surfaces are off that skin, not off one of more influences.
  body.skin = repair_skin_weights(body.skin, joint_count(body), {.max_slots = 4}).skin;
  const fs::path surfaces = seen_body(result);
  const bool seen = surfaces.filename() == "seen" && !looks.avatar.empty();
  if (seen) {
    const Mesh shared = read_sequence_header(surfaces).shared;
    body.mesh.uvs = shared.uvs;
    body.mesh.uv_faces = shared.uv_faces;
  }
  GltfScene scene = gltf_body(body, {}, clip.motion);
  for (GltfMesh& mesh : scene.meshes) {
    for (GltfPrimitive& primitive : mesh.primitives) {
      primitive.material = "skin";
    }
  }
  scene.materials.push_back(seen ? textured_skin(looks.avatar) : skin_material());
  add_surfaces(scene, body, clip, open_sequence(surfaces));
  for (const fs::path& garment : garments_of(result)) {
    const std::string name = garment.filename().string();
    const Sequence sequence = open_sequence(garment);
    Mesh shared = read_sequence_header(garment).shared;
    GltfMaterial look = cloth_material(name, looks.networks, shared);
    std::vector<Mesh> frames;
    for (Index i = 0; i < frame_count(sequence); ++i) {
      frames.push_back(frame(sequence, i));
      frames.back().uvs = shared.uvs;
      frames.back().uv_faces = shared.uv_faces;
    }
    GltfScene cloth = gltf_morph_sequence(frames, sequence.fps, name);
    for (GltfPrimitive& primitive : cloth.meshes.at(0).primitives) {
      primitive.material = look.name;
    }
    cloth.materials.push_back(std::move(look));
    scene = joined_scenes(std::move(scene), cloth);
  }
  show_first_keys(scene);
  return scene;
}

std::vector<NamedSequence> avatar_sequences(const fs::path& result) {
  std::vector<NamedSequence> all = {{"body", open_sequence(seen_body(result))}};
  for (const fs::path& garment : garments_of(result)) {
    all.push_back({garment.filename().string(), open_sequence(garment)});
  }
  return all;
}

}  // namespace atelier
