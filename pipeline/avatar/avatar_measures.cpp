#include "pipeline/avatar/avatar_measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "appearance/picture_similarity.h"
#include "appearance/psnr.h"
#include "appearance/visible_pixels.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/humanoid.h"
#include "capture/capture_info.h"
#include "capture/ground_truth_scan.h"
#include "core/io/child_program.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/normals.h"
#include "core/raster.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "core/tree.h"
#include "pipeline/appearance/appearance_judgement.h"
#include "pipeline/avatar/avatar_drawing.h"
#include "pipeline/avatar/avatar_result.h"
#include "pipeline/outfit/worn_subject.h"
#include "pipeline/pictures/paint_scene.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Side = Measure::Side;

/// Sum of something over an area or pixels.
struct Sum {
  double value = 0;
  double weight = 0;
  double mean() const { return weight > 0 ? value / weight : 0; }
};

/// The person as the workspace shows them in a frame.
struct ShownPerson {
  BodyAvatar avatar;
  Sequence bodies;
  std::optional<WornSubject> worn;
  std::map<int, FloatRows> offsets;  ///< by pose, of the frames that are judged

  /// The body under the clothes; no rows where there is none of the frame.
  Points body(int frame_id) const {
    const std::vector<int>& ids = bodies.frame_ids;
    const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
    return at == ids.end() || *at != frame_id ? Points(0, 3)
                                              : frame(bodies, at - ids.begin()).vertices;
  }
  /// The seen surface; no rows where there is no body of the frame.
  Points surface(int frame_id) const {
    const Points own = body(frame_id);
    const auto offset = offsets.find(frame_id);
    return own.rows() == 0           ? own
           : offset == offsets.end() ? seen_surface(avatar, own)
                                     : seen_surface(avatar, own, offset->second);
  }
};

/// The same with what poses do to the surface of these frames.
void pose_person(ShownPerson& person, const std::vector<int>& frames) {
  std::vector<Points> bodies;
  bodies.reserve(frames.size());
  for (const int id : frames) {
    bodies.push_back(person.body(id));
  }
  const std::vector<FloatRows> offsets = pose_offsets(person.avatar, bodies);
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    person.offsets[frames[i]] = offsets[i];
  }
}

/// Distances of the true seen skin, hair and shoes from the surface, by label.
std::map<Label, Sum> surface_distances(const ShownPerson& person, const GroundTruth& truth,
                                       const fs::path& capture, const std::vector<int>& frames) {
  std::map<Label, Sum> sums;
  for (const int id : frames) {
    const Points surface = person.surface(id);
    if (surface.rows() == 0) {
      continue;
    }
    const Mesh scan = ground_truth_scan(truth, read_ground_truth_frame(capture, truth, id));
    const Eigen::VectorXd areas = vertex_areas(scan.vertices, scan.faces);
    const std::vector<ClosestPoint> closest =
        closest_points(build_tree(surface, person.avatar.rest.faces), scan.vertices);
    for (std::size_t i = 0; i < closest.size(); ++i) {
      Sum& sum = sums[static_cast<Label>(scan.labels[i])];
      const double area = areas[static_cast<Index>(i)];
      sum.value += area * std::sqrt(closest[i].squared_distance);
      sum.weight += area;
    }
  }
  return sums;
}

/// Faces of the true body that are head or hands: whose corners these joints move most.
std::vector<char> head_and_hands(const GroundTruth& truth) {
  std::vector<char> of_face(static_cast<std::size_t>(truth.body.faces.rows()), 0);
  const std::optional<Humanoid> person = find_humanoid(truth.skeleton);
  if (!person) {
    return of_face;
  }
  std::set<int> joints = {person->neck.back(), person->arms[0].wrist, person->arms[1].wrist};
  const std::vector<int>& parents = truth.skeleton.parents;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    if (joints.contains(parents[j])) {
      joints.insert(static_cast<int>(j));
    }
  }
  for (Index f = 0; f < truth.body.faces.rows(); ++f) {
    const int v = truth.body.faces(f, 0);
    Index most = 0;
    truth.skin_weights.row(v).maxCoeff(&most);
    of_face[static_cast<std::size_t>(f)] = joints.contains(truth.skin_joints(v, most)) ? 1 : 0;
  }
  return of_face;
}

/// Vertices of the true body that another of these frames has under a layer which a frame lacks:
/// feet that are bare in minimally clothed frames and shod in clothed ones. An avatar wears the
/// shoes throughout, and cannot be judged by feet.
std::map<int, std::vector<char>> covered_elsewhere(const WornSubject& truth,
                                                   const std::vector<int>& frames) {
  constexpr double kNear = 0.03;  // m from a shoe to the foot in it
  std::map<int, std::vector<char>> covered;
  for (std::size_t layer = 1; layer < truth.first_garment; ++layer) {
    std::vector<int> without;
    std::vector<char> under;
    for (const int id : frames) {
      const std::vector<Points> vertices = truth.subject.load(id);
      if (vertices[layer].rows() == 0) {
        without.push_back(id);
      } else if (under.empty()) {
        for (const ClosestPoint& closest :
             closest_points(build_tree(vertices[layer], truth.subject.faces[layer]), vertices[0])) {
          under.push_back(closest.squared_distance < kNear * kNear ? 1 : 0);
        }
      }
    }
    for (const int id : without) {
      std::vector<char>& all = covered[id];
      all.resize(under.size(), 0);
      for (std::size_t v = 0; v < under.size(); ++v) {
        all[v] = static_cast<char>(all[v] | under[v]);
      }
    }
  }
  return covered;
}

/// Pixels in which a camera truly sees skin, hair or shoes, away from outlines.
struct JudgedPixels {
  std::vector<int> pixel;
  std::vector<char> detail;  ///< of head and hands
};

/// @param detail   of the true body's faces, whether they count as head or hands
/// @param left_out of its vertices, whether their faces are not judged; empty: none
JudgedPixels judged_pixels(const WornSubject& truth, const std::vector<char>& detail,
                           const std::vector<char>& left_out, const Camera& camera, int frame_id) {
  const std::vector<Points> vertices = truth.subject.load(frame_id);
  std::vector<Surface> surfaces;
  Index body_faces = 0;
  for (std::size_t s = 0; s < vertices.size(); ++s) {
    if (vertices[s].rows() > 0) {
      surfaces.push_back({&vertices[s], &truth.subject.faces[s]});
      body_faces += s < truth.first_garment ? truth.subject.faces[s].rows() : 0;
    }
  }
  const JoinedSurfaces all = joined_surfaces(surfaces);
  const Raster raster = rasterize(all.vertices, all.faces, camera);
  const VisiblePixels seen =
      visible_pixels(raster, 0, Points2::Zero(1, 2), Triangles::Zero(body_faces, 3));
  const Triangles& body = truth.subject.faces[0];
  const auto is_left_out = [&](std::size_t face) {
    const auto row = static_cast<Index>(face);
    return !left_out.empty() && row < body.rows() &&
           left_out[static_cast<std::size_t>(body(row, 0))] != 0;
  };
  JudgedPixels judged;
  for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
    const auto face =
        static_cast<std::size_t>(raster.face.data[static_cast<std::size_t>(seen.pixel[i])]);
    if (seen.trusted[i] != 0 && !is_left_out(face)) {
      judged.pixel.push_back(seen.pixel[i]);
      judged.detail.push_back(face < detail.size() ? detail[face] : 0);
    }
  }
  return judged;
}

/// What the workspace shows, as a subject whose first surface is the seen body.
DressedSubject shown_subject(const ShownPerson& person) {
  DressedSubject subject;
  subject.names = {"body"};
  subject.faces = {person.avatar.rest.faces};
  if (person.worn) {
    const DressedSubject& worn = person.worn->subject;
    subject.names.insert(subject.names.end(), worn.names.begin() + 1, worn.names.end());
    subject.faces.insert(subject.faces.end(), worn.faces.begin() + 1, worn.faces.end());
  }
  subject.load = [&person](int frame_id) {
    std::vector<Points> all = {person.surface(frame_id)};
    if (person.worn) {
      const std::vector<Points> worn = person.worn->subject.load(frame_id);
      all.insert(all.end(), worn.begin() + 1, worn.end());
    }
    return all;
  };
  return subject;
}

Image stored_picture(const fs::path& file) {
  const ByteImage bytes = read_byte_image(file);
  Image picture(bytes.width, bytes.height, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i) {
    picture.data[i] = static_cast<float>(bytes.data[i]) / 255;
  }
  return picture;
}

/// In [0,1] as 8-bit sRGB holds it.
Image stored(const Image& linear) {
  const ByteImage bytes = srgb_from_linear(linear);
  Image picture(bytes.width, bytes.height, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i) {
    picture.data[i] = static_cast<float>(bytes.data[i]) / 255;
  }
  return picture;
}

/// How alike images are: squares of differences over pixels and channels.
struct Likeness {
  Sum drawn, fixed, detail;
  Sum similarity;
  double judged = 0;
  double covered = 0;
};

void compare_view(Likeness& sum, const JudgedPixels& judged, const AppearanceView& own,
                  const Image& wanted, const Image& drawn, const Image& fixed) {
  ByteImage is_drawn(wanted.width, wanted.height, 1);
  for (const int pixel : own.pixel) {
    is_drawn.data[static_cast<std::size_t>(pixel)] = 1;
  }
  ByteImage mask(wanted.width, wanted.height, 1);
  double pixels = 0;
  for (std::size_t i = 0; i < judged.pixel.size(); ++i) {
    const auto place = static_cast<std::size_t>(judged.pixel[i]);
    sum.judged += 1;
    if (is_drawn.data[place] == 0) {
      continue;
    }
    sum.covered += 1;
    pixels += 1;
    mask.data[place] = 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const double off = drawn.data[3 * place + c] - wanted.data[3 * place + c];
      const double still = fixed.data[3 * place + c] - wanted.data[3 * place + c];
      sum.drawn.value += off * off;
      sum.drawn.weight += 1;
      sum.fixed.value += still * still;
      sum.fixed.weight += 1;
      if (judged.detail[i] != 0) {
        sum.detail.value += off * off;
        sum.detail.weight += 1;
      }
    }
  }
  if (pixels > 0) {
    sum.similarity.value += pixels * structural_similarity(drawn, wanted, mask);
    sum.similarity.weight += pixels;
  }
}

Likeness likeness_of(const ShownPerson& person, const fs::path& capture,
                     const std::shared_ptr<const GroundTruth>& truth,
                     const std::vector<Camera>& cameras, const std::vector<int>& frames) {
  Likeness sum;
  const AppearanceModel model = avatar_model_at(person.avatar.model);
  const WornSubject in_truth = worn_in_truth(capture, truth);
  const std::vector<char> detail = head_and_hands(*truth);
  std::map<int, std::vector<char>> left_out = covered_elsewhere(in_truth, frames);
  const auto [asked, colors] =
      drawn_views(person.avatar.model, model, shown_subject(person), cameras, frames, Device::Cpu);
  const std::vector<Eigen::Vector3d> gains = gains_of(cameras, truth->cameras, model.camera_ids);
  std::size_t first = 0;
  for (const AppearanceView& view : asked.views) {
    const auto c = static_cast<std::size_t>(view.camera_idx);
    const int id = frames[static_cast<std::size_t>(view.frame_idx)];
    const Image wanted =
        stored_picture(capture / "truth" / "images" / cameras[c].id / (frame_name(id) + ".png"));
    const Image none(wanted.width, wanted.height, 3);
    compare_view(sum, judged_pixels(in_truth, detail, left_out[id], cameras[c], id), view, wanted,
                 stored(with_drawn_pixels(none, view, colors.drawn, first, gains[c])),
                 stored(with_drawn_pixels(none, view, colors.fixed, first, gains[c])));
    first += view.pixel.size();
  }
  return sum;
}

/// Pixels in which a camera truly sees the person, away from outlines and from where one surface
/// ends before another.
std::vector<int> person_pixels(const WornSubject& truth, const Camera& camera, int frame_id) {
  const std::vector<Points> vertices = truth.subject.load(frame_id);
  std::vector<Surface> surfaces;
  Index faces = 0;
  for (std::size_t s = 0; s < vertices.size(); ++s) {
    if (vertices[s].rows() > 0) {
      surfaces.push_back({&vertices[s], &truth.subject.faces[s]});
      faces += truth.subject.faces[s].rows();
    }
  }
  const JoinedSurfaces all = joined_surfaces(surfaces);
  const VisiblePixels seen = visible_pixels(rasterize(all.vertices, all.faces, camera), 0,
                                            Points2::Zero(1, 2), Triangles::Zero(faces, 3));
  std::vector<int> pixels;
  for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
    if (seen.trusted[i] != 0) {
      pixels.push_back(seen.pixel[i]);
    }
  }
  return pixels;
}

/// The person as `animate` draws them, of the networks of body and garments; without frames where a
/// garment has none.
PaintedScene person_scene(const ShownPerson& person, const fs::path& networks,
                          const std::vector<int>& frames) {
  PaintedScene scene;
  const DressedSubject subject = shown_subject(person);
  for (std::size_t s = 0; s < subject.names.size(); ++s) {
    SceneLayer layer;
    layer.name = subject.names[s];
    layer.model =
        (s == 0 ? person.avatar.model : networks / layer.name / "model.safetensors").string();
    layer.faces = subject.faces[s];
    if (!fs::exists(layer.model)) {
      return {};
    }
    scene.layers.push_back(std::move(layer));
  }
  scene.layers.front().over = over_clothes(person.avatar);
  for (const int id : frames) {
    scene.frame_ids.push_back(id);
    scene.vertices.push_back(subject.load(id));
  }
  return scene;
}

/// How alike whole persons are.
struct PersonLikeness {
  Sum squares, similarity;
};

PersonLikeness person_likeness(const ShownPerson& person, const fs::path& networks,
                               const fs::path& capture,
                               const std::shared_ptr<const GroundTruth>& truth,
                               const std::vector<Camera>& cameras, const std::vector<int>& frames) {
  PersonLikeness sum;
  PaintedScene scene = person_scene(person, networks, frames);
  if (scene.frame_ids.empty()) {
    return sum;
  }
  const WornSubject in_truth = worn_in_truth(capture, truth);
  const std::vector<Eigen::Vector3d> gains =
      gains_of(cameras, truth->cameras, avatar_model_at(person.avatar.model).camera_ids);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    scene.cameras = {cameras[c]};
    PaintHooks hooks;
    hooks.picture = [&](Index f, const Image& picture) {
      const int id = frames[static_cast<std::size_t>(f)];
      const Image wanted =
          stored_picture(capture / "truth" / "images" / cameras[c].id / (frame_name(id) + ".png"));
      Image lit(picture.width, picture.height, 3);
      for (std::size_t i = 0; i < lit.data.size(); ++i) {
        lit.data[i] = picture.data[i / 3 * 4 + i % 3] *
                      static_cast<float>(gains[c][static_cast<Index>(i % 3)]);
      }
      const Image drawn = stored(lit);
      ByteImage mask(wanted.width, wanted.height, 1);
      const std::vector<int> pixels = person_pixels(in_truth, cameras[c], id);
      for (const int pixel : pixels) {
        const auto place = static_cast<std::size_t>(pixel);
        mask.data[place] = 1;
        for (std::size_t k = 0; k < 3; ++k) {
          const double off = drawn.data[3 * place + k] - wanted.data[3 * place + k];
          sum.squares.value += off * off;
          sum.squares.weight += 1;
        }
      }
      const auto count = static_cast<double>(pixels.size());
      sum.similarity.value += count * structural_similarity(drawn, wanted, mask);
      sum.similarity.weight += count;
    };
    PaintOptions options;
    options.samples = 1;  // as pixels of the images are compared
    paint_scene(scene, options, Device::Cpu, hooks);
  }
  return sum;
}

/// The folder of an input of a result; nothing where it read none.
std::optional<fs::path> input_folder(const fs::path& workspace, const char* stage) {
  const auto current = current_name(workspace / stage);
  return current ? std::optional(workspace / stage / *current) : std::nullopt;
}

void add_distances(std::vector<Measure>& measures, const std::map<Label, Sum>& sums) {
  Sum all;
  for (const Label label : {Label::Skin, Label::Hair, Label::Shoes}) {
    const auto found = sums.find(label);
    if (found != sums.end()) {
      all.value += found->second.value;
      all.weight += found->second.weight;
    }
  }
  if (all.weight == 0) {
    return;
  }
  measures.push_back({"avatar.mean_mm", 1e3 * all.mean(), "mm", 4, Side::AtMost,
                      "ground-truth skin, hair and shoes that two cameras see, from the surface "
                      "posed with its mean displacement"});
  for (const auto& [label, key] :
       {std::pair{Label::Hair, "avatar.hair_mm"}, std::pair{Label::Shoes, "avatar.shoes_mm"}}) {
    if (const auto found = sums.find(label); found != sums.end()) {
      measures.push_back({key, 1e3 * found->second.mean(), "mm", 4, Side::None, "of these alone"});
    }
  }
}

void add_likeness(std::vector<Measure>& measures, const Likeness& sum) {
  if (sum.covered == 0) {
    return;
  }
  const double drawn = psnr_of(sum.drawn.mean());
  const double fixed = psnr_of(sum.fixed.mean());
  measures.push_back(
      {"avatar.psnr_db", drawn, "dB", 30, Side::AtLeast,
       "eroded pixels of skin, hair and shoes, held-out cameras x held-out frames; not of "
       "feet that are bare in some of these frames and shod in others"});
  measures.push_back(
      {"avatar.static_psnr_db", fixed, "dB", 0, Side::None, "of the skinned mean texture alone"});
  measures.push_back({"avatar.gain_db", drawn - fixed, "dB", 3, Side::AtLeast, "over that"});
  if (sum.detail.weight > 0) {
    measures.push_back({"avatar.head_hands_psnr_db", psnr_of(sum.detail.mean()), "dB", 28,
                        Side::AtLeast, "of face and hands among these pixels"});
  }
  measures.push_back({"avatar.ssim", sum.similarity.mean(), "", 0, Side::None,
                      "structural similarity of these pixels"});
  measures.push_back({"avatar.covered", sum.covered / sum.judged, "", 0.95, Side::AtLeast,
                      "of these pixels, drawn by the avatar; the others are not evaluated"});
}

void add_person(std::vector<Measure>& measures, const PersonLikeness& sum) {
  if (sum.squares.weight == 0) {
    return;
  }
  measures.push_back({"avatar.person_psnr_db", psnr_of(sum.squares.mean()), "dB", 31, Side::AtLeast,
                      "eroded pixels of body and garments as they are drawn together, held-out "
                      "cameras x held-out frames"});
  measures.push_back({"avatar.person_ssim", sum.similarity.mean(), "", 0.95, Side::AtLeast,
                      "structural similarity of these pixels"});
}

}  // namespace

std::vector<Measure> measure_avatar(const fs::path& workspace, const fs::path& capture) {
  const auto result = input_folder(workspace, "avatar");
  const auto person = input_folder(workspace, "personalize");
  const auto bodies = input_folder(workspace, "body");
  if (!result || !person || !bodies) {
    return {};
  }
  ShownPerson shown;
  shown.avatar = read_body_avatar(*result, read_personal_body(*person / "person.npz").model);
  shown.bodies = open_sequence(*bodies);
  if (const auto registered = input_folder(workspace, "register")) {
    shown.worn = worn_in_workspace(*registered, *bodies);
  }
  const CaptureInfo info = read_capture_info(capture);
  const auto truth = std::make_shared<const GroundTruth>(read_ground_truth(capture));
  std::vector<int> frames;  // of which there is a body
  for (const int id : info.held_out_frames) {
    if (shown.body(id).rows() > 0) {
      frames.push_back(id);
    }
  }
  const std::vector<int> judged = frames.empty() ? shown.bodies.frame_ids : frames;
  pose_person(shown, judged);
  std::vector<Measure> measures;
  add_distances(measures, surface_distances(shown, *truth, capture, judged));
  std::vector<Camera> cameras;
  for (const Camera& camera : truth->cameras) {
    if (std::count(info.held_out_cameras.begin(), info.held_out_cameras.end(), camera.id) > 0) {
      cameras.push_back(camera);
    }
  }
  if (!cameras.empty() && !frames.empty()) {
    add_likeness(measures, likeness_of(shown, capture, truth, cameras, frames));
    const auto networks = input_folder(workspace, "appearance");
    if (networks && shown.worn && has_child_program("atelier-appearance")) {
      add_person(measures, person_likeness(shown, *networks, capture, truth, cameras, frames));
    }
  }
  return measures;
}

}  // namespace atelier
