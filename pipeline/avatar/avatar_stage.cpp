#include "pipeline/avatar/avatar_stage.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "appearance/psnr.h"
#include "appearance/static_fit.h"
#include "bodymodel/surface_frames.h"
#include "capture/frame_reader.h"
#include "core/io/child_program.h"
#include "core/io/image_file.h"
#include "core/io/safetensors.h"
#include "core/render/contact_sheet.h"
#include "core/sequence_archive.h"
#include "core/store/frame_memory.h"
#include "core/store/output_sequences.h"
#include "core/three_channels.h"
#include "core/usage_error.h"
#include "pipeline/appearance/tell_contradictions.h"
#include "pipeline/appearance/train_network.h"
#include "pipeline/avatar/avatar_crops.h"
#include "pipeline/avatar/avatar_drawing.h"
#include "pipeline/avatar/avatar_result.h"
#include "pipeline/avatar/shoe_soles.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

OuterSurface fitted_surface(const AvatarInput& input, const OuterSurfaceOptions& options, int id) {
  const Points body = body_of_frame(input, id);
  ClothedScan scan = avatar_scan(input, id);
  check_scan_of_body(scan, body, frame_name(id));
  add_soles(scan, input.person.model, body);
  return outer_surface(input.person.model.mesh.faces, body, scan_surface(scan, frame_name(id)),
                       options);
}

/// The surfaces of all frames, kept or fitted again.
using SurfaceMemory = FrameMemory<OuterSurface>;

bool write_surfaces(StageRun& run, const AvatarInput& input, const PackedAtlas& atlas,
                    SurfaceMemory& memory) {
  SequenceHeader header;
  header.fps = input.fps;
  header.frame_ids = input.frame_ids;
  header.shared.faces = input.person.model.mesh.faces;
  header.shared.uvs = atlas.uvs;
  header.shared.uv_faces = atlas.uv_faces;
  const auto& options = run.options<AvatarStageOptions>().surface;
  return output_sequences(run, {{"surface/frames", header}}, input.frame_ids, [&](int id) {
    OuterSurface surface = fitted_surface(input, options, id);
    Mesh mesh;
    mesh.vertices = surface.vertices;
    memory.keep(id, std::move(surface));
    return std::vector<Archive>{archive_of(mesh)};
  });
}

void tell_distances(StageRun& run, const std::vector<OuterSurface>& surfaces) {
  double skin = 0;
  double cover = 0;
  double skin_area = 0;
  double cover_area = 0;
  double turned = 0;
  for (const OuterSurface& surface : surfaces) {
    skin += surface.skin_area * surface.skin_distance;
    cover += surface.cover_area * surface.cover_distance;
    skin_area += surface.skin_area;
    cover_area += surface.cover_area;
    turned = std::max(turned, static_cast<double>(surface.turned));
  }
  if (skin_area > 0) {
    run.metric("skin_distance", skin / skin_area);
  }
  if (cover_area > 0) {
    run.metric("cover_distance", cover / cover_area);
  } else {
    run.warn("no scan has hair or shoes by its labels: the body is seen without their volume");
  }
  run.metric("turned_faces", turned);
}

/// Vertices of which clothed frames alone are asked, since they have hair or shoes there that the
/// minimally clothed person has not, or the other way round; none where all frames are of one kind.
std::vector<char> clothed_alone(const AvatarInput& input,
                                const std::vector<OuterSurface>& surfaces) {
  std::vector<const OuterSurface*> minimal;
  std::vector<const OuterSurface*> clothed;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    (input.minimal.contains(input.frame_ids[i]) ? minimal : clothed).push_back(&surfaces[i]);
  }
  return minimal.empty() || clothed.empty()
             ? std::vector<char>()
             : differently_covered(input.person.model.mesh.faces, minimal, clothed);
}

/// Takes from minimally clothed frames what clothed ones alone are asked.
void leave_out(const AvatarInput& input, const std::vector<char>& vertices,
               std::vector<OuterSurface>& surfaces) {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    if (!input.minimal.contains(input.frame_ids[i])) {
      continue;
    }
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      surfaces[i].support[static_cast<Index>(v)] *= vertices[v] != 0 ? 0 : 1;
    }
  }
}

/// The same of pixels.
AppearanceData leave_out(AppearanceData data, const AvatarInput& input,
                         const std::vector<char>& vertices) {
  if (vertices.empty()) {
    return data;
  }
  constexpr int kSide = 256;  // texels
  const TexelMap map = texel_map(data.faces, data.uvs, data.uv_faces, kSide);
  Eigen::MatrixXf flags(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    flags.row(static_cast<Index>(v)).setConstant(vertices[v] != 0 ? 1.0F : 0.0F);
  }
  const Image texture = texture_of(map, texel_values(map, data.faces, flags));
  std::vector<int> ids;
  std::transform(data.frames.begin(), data.frames.end(), std::back_inserter(ids),
                 [](const SurfaceFrame& frame) { return frame.frame_id; });
  return without_pixels(std::move(data), [&](const AppearanceView& view) {
    std::vector<char> left(view.pixel.size(), 0);
    if (input.minimal.contains(ids[static_cast<std::size_t>(view.frame_idx)])) {
      const std::vector<float> at = sample_texture(texture, {view.u, view.v, {}});
      for (std::size_t p = 0; p < left.size(); ++p) {
        left[p] = at[3 * p] > 0.5F ? 1 : 0;
      }
    }
    return left;
  });
}

/// The person with the seen surface for its rest surface.
PersonalBody seen_person(const AvatarInput& input, const PackedAtlas& atlas,
                         const std::vector<OuterSurface>& surfaces) {
  const Triangles& faces = input.person.model.mesh.faces;
  std::vector<Points> displacements;
  std::vector<Eigen::VectorXd> supports;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Points body = body_of_frame(input, input.frame_ids[i]);
    displacements.push_back(
        in_surface_frames(surface_frames(body, faces), surfaces[i].vertices - body));
    supports.push_back(surfaces[i].support);
  }
  PersonalBody seen = input.person;
  Points& rest = seen.model.mesh.vertices;
  rest +=
      from_surface_frames(surface_frames(rest, faces), mean_displacement(displacements, supports));
  seen.model.mesh.normals.resize(0, 3);
  seen.model.mesh.uvs = atlas.uvs;
  seen.model.mesh.uv_faces = atlas.uv_faces;
  return seen;
}

/// What the network is conditioned on, and what each frame's surface is off the mean one.
BodyShapes body_shapes(const AvatarInput& input, const PersonalBody& seen,
                       const std::vector<OuterSurface>& surfaces) {
  const BodyModel& model = seen.model;
  std::vector<int> joints;
  for (Index v = 0; v < model.skin.weights.rows(); ++v) {
    Index most = 0;
    model.skin.weights.row(v).maxCoeff(&most);
    joints.push_back(model.skin.joints(v, most));
  }
  BodyShapes shapes;
  shapes.parts = body_parts(model.mesh.vertices, joints, model.skeleton.parents);
  if (!input.faces.empty()) {
    const int head = shapes.parts.part[static_cast<std::size_t>(head_vertices(model).front())];
    shapes.parts = with_face(std::move(shapes.parts), head,
                             static_cast<int>(input.faces.begin()->second.size() / 3));
  }
  const BodyAvatar avatar = body_avatar(model.mesh, input.person.model);
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Points mean = seen_surface(avatar, body_of_frame(input, input.frame_ids[i]));
    shapes.offset.emplace_back(
        in_surface_frames(surface_frames(mean, model.mesh.faces), surfaces[i].vertices - mean)
            .cast<float>());
    shapes.support.emplace_back(surfaces[i].support.cast<float>().cwiseMax(0).cwiseMin(1));
  }
  return shapes;
}

/// Of the frames that the data has.
BodyShapes shapes_of(const BodyShapes& all, const AvatarInput& input, const AppearanceData& data) {
  BodyShapes own{all.parts, {}, {}};
  for (const SurfaceFrame& frame : data.frames) {
    const auto at = static_cast<std::size_t>(
        std::lower_bound(input.frame_ids.begin(), input.frame_ids.end(), frame.frame_id) -
        input.frame_ids.begin());
    own.offset.push_back(all.offset[at]);
    own.support.push_back(all.support[at]);
  }
  return own;
}

/// The seen surfaces, and before them what is worn over them.
DressedSubject subject_of(const AvatarInput& input, const std::vector<OuterSurface>& surfaces) {
  DressedSubject subject;
  subject.names = {"body"};
  subject.faces = {input.person.model.mesh.faces};
  if (input.worn) {
    const DressedSubject& worn = input.worn->subject;
    subject.names.insert(subject.names.end(), worn.names.begin() + 1, worn.names.end());
    subject.faces.insert(subject.faces.end(), worn.faces.begin() + 1, worn.faces.end());
  }
  if (!input.faces.empty()) {
    subject.face = [&input](int frame_id) { return input.faces.at(frame_id); };
  }
  subject.load = [&input, &surfaces](int frame_id) {
    const auto at = std::lower_bound(input.frame_ids.begin(), input.frame_ids.end(), frame_id) -
                    input.frame_ids.begin();
    std::vector<Points> all = {surfaces[static_cast<std::size_t>(at)].vertices};
    if (input.worn) {
      const std::vector<Points> worn = input.worn->subject.load(frame_id);
      all.insert(all.end(), worn.begin() + 1, worn.end());
    }
    return all;
  };
  return subject;
}

/// A camera's image with which of its pixels show the body; without labels the mask says that of a
/// minimally clothed person, and of a clothed one nothing does: no image.
TakenPicture taken_picture(FrameReader& reader, const AvatarInput& input, std::size_t camera,
                           int frame_id) {
  const Index idx = input.camera_idx[camera];
  ByteImage labels = reader.labels(idx, frame_id).value_or(ByteImage());
  const bool minimal = input.minimal.contains(frame_id);
  if (labels.data.empty() && minimal) {
    labels = reader.mask(idx, frame_id).value_or(ByteImage());
    for (std::uint8_t& pixel : labels.data) {
      pixel = static_cast<std::uint8_t>(pixel != 0 ? Label::Skin : Label::Background);
    }
  }
  if (labels.data.empty() && !minimal) {
    return {};
  }
  return {in_three_channels(reader.byte_image(idx, frame_id).value_or(ByteImage())),
          body_labels(std::move(labels), minimal)};
}

Eigen::Vector3d gain_of(const AppearanceModel& model, int camera) {
  const float* gain = &model.static_gain[3 * static_cast<std::size_t>(camera)];
  return {gain[0], gain[1], gain[2]};
}

/// dB between the training's pixels and the mean texture, as 8-bit sRGB holds them.
double training_psnr(const AppearanceModel& model, const AppearanceData& data) {
  double squares = 0;
  double count = 0;
  for (const AppearanceView& view : data.views) {
    const std::vector<float> shown = sample_texture(model.static_texture, {view.u, view.v, {}});
    const Eigen::Vector3d gain = gain_of(model, view.camera_idx);
    Image picture(static_cast<int>(view.u.size()), 1, 3);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      picture.data[i] = shown[i] * static_cast<float>(gain[static_cast<Index>(i % 3)]);
    }
    const ByteImage bytes = srgb_from_linear(picture);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const double off = (static_cast<double>(bytes.data[i]) - view.colors[i]) / 255;
      squares += off * off;
      count += 1;
    }
  }
  return psnr_of(squares / count);
}

/// pictures.png and crops.png: whole images and details that it was made from, beside what is
/// drawn.
void show(StageRun& run, const ShownViews& shown, const AppearanceModel& model,
          const AvatarInput& input, const DressedSubject& subject, FrameReader& reader) {
  const auto write = [&](const char* name, const std::vector<CaptionedImage>& pairs,
                         const ContactSheetOptions& sheet) {
    if (!pairs.empty()) {
      run.output_text(name, image_bytes(contact_sheet(pairs, sheet), ImageFormat::Png));
    }
  };
  const ReadPicture read = [&](std::size_t camera, int id) {
    return taken_picture(reader, input, camera, id);
  };
  ContactSheetOptions sheet;
  sheet.columns = 6;
  sheet.cell_width = 300;
  write("pictures.png", avatar_images(shown, model, read), sheet);
  ContactSheetOptions details;
  details.columns = 4;
  details.text_height = 14;
  write("crops.png", avatar_crops(shown, model, input, subject, read), details);
}

/// What a texture is made from, of all frames.
AppearanceData prepared_data(StageRun& run, const AvatarInput& input, const DressedSubject& subject,
                             const DrawnSurface& surface, FrameReader& reader) {
  const auto& options = run.options<AvatarStageOptions>();
  AppearanceData data = prepare_appearance(
      subject, surface,
      {input.cameras, input.frame_ids,
       [&](std::size_t camera, int id) { return taken_picture(reader, input, camera, id); }},
      options.prepare, run.device());
  return without_grazing(std::move(data), options.texture);
}

/// A training whose texture is as fine as the images are: texels that no pixel is near would stay
/// as they begin.
TrainOptions as_fine_as(TrainOptions known, const TrainOptions& asked, const AppearanceData& data) {
  constexpr double kPixels = 3;  // of all images for a texel, at least
  constexpr int kCoarsest = 64;
  constexpr int kSide = 64;
  double pixels = 0;
  for (const AppearanceView& view : data.views) {
    pixels += static_cast<double>(view.pixel.size());
  }
  const auto covered =
      static_cast<double>(texel_map(data.faces, data.uvs, data.uv_faces, kSide).covered.size());
  const auto fits = [&](int resolution) {
    return asked.shading == 0 || resolution >= 8 * asked.shading;
  };
  while (asked.resolution == 0 && known.resolution > kCoarsest && fits(known.resolution / 2) &&
         pixels < kPixels * covered * known.resolution * known.resolution / (kSide * kSide)) {
    known.resolution /= 2;
    known.shading = asked.shading == 0 ? std::max(1, known.shading / 2) : known.shading;
  }
  return known;
}

/// Trains the branches that make more of the texture than its mean. False if the run was told to
/// stop.
bool train_branches(StageRun& run, const AppearanceData& data, const TrainOptions& known,
                    double fixed, const fs::path& model) {
  const fs::path scratch = run.scratch_folder();
  const TrainingFiles files{scratch / "data.h5", model, scratch / "training.csv",
                            scratch / "checkpoint.safetensors"};
  write_archive(files.data, archive_of(data));
  const Trained trained =
      train_network(run, "body", known, static_cast<int>(data.views.size()), files);
  if (!trained.done) {
    return false;
  }
  require_learnt(run, "body", trained.psnr, fixed);
  run.output("body/training.csv", [&](const fs::path& to) {
    fs::copy_file(files.log, to, fs::copy_options::overwrite_existing);
  });
  run.metric("iterations", known.iterations);
  if (trained.psnr) {
    run.metric("training_psnr_db", *trained.psnr);
  }
  if (trained.steps > 0) {
    run.metric("seconds_a_step", trained.seconds / trained.steps);
  }
  return true;
}

/// The texture of the surfaces, and what it was made from in pictures. False if the run was told to
/// stop.
bool write_texture(StageRun& run, const AvatarInput& input, const PackedAtlas& atlas,
                   const std::vector<OuterSurface>& surfaces, const BodyShapes& shapes,
                   const std::vector<char>& clothed) {
  const auto& options = run.options<AvatarStageOptions>();
  const DressedSubject subject = subject_of(input, surfaces);
  FrameReader reader(input.dataset);
  DrawnSurface surface;
  surface.label = static_cast<int>(Label::Skin);
  surface.hidden = !input.worn;
  surface.atlas = atlas;
  AppearanceData data =
      leave_out(prepared_data(run, input, subject, surface, reader), input, clothed);
  data.body = shapes_of(shapes, input, data);
  const TrainOptions known =
      as_fine_as(avatar_training(options, run.device()), options.train, data);
  run.say("texture of " + std::to_string(known.resolution) + " texels a side");
  if (run.stop_requested()) {
    return false;
  }
  tell_contradictions(run, data, static_fit(data, judged_texels(data)));
  AppearanceModel model =
      mean_texture_model(data, known.resolution, options.texture, known.smoothness);
  const double mean = training_psnr(model, data);
  run.metric("views", static_cast<double>(data.views.size()));
  run.metric("seen_rate", seen_share(data, known.resolution));
  run.metric("mean_psnr_db", mean);
  run.output_text("texture.png", image_bytes(model.static_texture, ImageFormat::Png));
  const fs::path file = run.scratch_folder() / "model.safetensors";
  const bool trained = options.network && has_child_program("atelier-appearance");
  if (trained) {
    if (!train_branches(run, data, known, mean, file)) {
      return false;
    }
    model = avatar_model_at(file);
  } else {
    if (options.network) {
      run.warn("built without libtorch: the body has its mean texture alone");
    }
    write_safetensors(file, {tensors_of(model), texts_of(model)});
  }
  const ShownViews shown = shown_views(file, model, input, subject, run.device());
  model.drawn = drawn_range(shown.drawn.colors);
  run.metric("drawn_low", model.drawn->low);
  run.metric("drawn_high", model.drawn->high);
  run.output("body/model.safetensors", [&](const fs::path& to) {
    write_safetensors(to, {tensors_of(model), texts_of(model)});
  });
  show(run, shown, model, input, subject, reader);
  return true;
}

}  // namespace

OptionTable describe(AvatarStageOptions& options) {
  OptionTable table;
  table.add("kind", options.kind,
            {{"all", AvatarKind::All},
             {"minimal", AvatarKind::Minimal},
             {"underlying", AvatarKind::Underlying}},
            "Frames that the avatar is made from: the minimally clothed sequence, skin, hair and "
            "shoes of the clothed ones (underlying), or all");
  table.add(describe_with_code(options.train));
  table.add("network", options.network,
            "Training of a network for the body's texture; off: the mean texture alone");
  table.add("surface", describe(options.surface));
  table.add("texture", describe(options.texture));
  table.add(describe(options.prepare));
  table.add("capture", describe(options.capture));
  return table;
}

TrainOptions avatar_training(const AvatarStageOptions& options, Device device) {
  TrainOptions known = resolved(options.train, device);
  constexpr int kMaxSide = 2048;
  constexpr int kMaxShading = 16;
  if (options.train.resolution == 0) {
    known.resolution = std::min(kMaxSide, 2 * known.resolution);
  }
  if (options.train.shading == 0) {
    known.shading = std::min(kMaxShading, 2 * known.shading);
  }
  if (const std::string problem = training_problem(known, device); !problem.empty()) {
    throw UsageError(problem);
  }
  return known;
}

void run_avatar(StageRun& run) {
  const auto& options = run.options<AvatarStageOptions>();
  const TrainOptions known = avatar_training(options, run.device());  // refused before fitting
  const AvatarInput input = avatar_input(run, options.kind, options.capture);
  const PackedAtlas atlas =
      pack_atlas(input.person.model.mesh, {.resolution = std::max(16, known.resolution / 2)});
  SurfaceMemory memory;
  if (!write_surfaces(run, input, atlas, memory)) {
    return;
  }
  std::vector<OuterSurface> surfaces;
  for (const int id : input.frame_ids) {
    surfaces.push_back(memory.take(id, [&] { return fitted_surface(input, options.surface, id); }));
  }
  tell_distances(run, surfaces);
  const std::vector<char> clothed = clothed_alone(input, surfaces);
  leave_out(input, clothed, surfaces);
  const PersonalBody seen = seen_person(input, atlas, surfaces);
  run.output("avatar.npz", [&](const fs::path& file) { write_personal_body(file, seen); });
  if (!write_texture(run, input, atlas, surfaces, body_shapes(input, seen, surfaces), clothed)) {
    return;
  }
  run.metric("frames", static_cast<double>(input.frame_ids.size()));
  run.metric("minimal", static_cast<double>(input.minimal.size()));
}

}  // namespace atelier
