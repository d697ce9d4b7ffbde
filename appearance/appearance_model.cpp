#include "appearance/appearance_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "appearance/blank_model.h"
#include "appearance/content_digest.h"
#include "appearance/fill_texture.h"
#include "appearance/learnt_occlusion.h"
#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/random.h"
#include "core/renamed_options.h"

namespace atelier {
namespace {

constexpr const char* kVersion = "4";
constexpr const char* kWithoutCode = "3";  // of networks of before, none of which has a code
constexpr int kMinSide = 8;                // texels a side where the UNet turns round
constexpr int kMaxGrowth = 8;              // of its widths

int width_of(const NetworkOptions& options, int level) {
  return options.channels * std::min(1 << std::min(level, 16), kMaxGrowth);
}

/// A convolution: its parameters' shapes. `side` is of what it gives.
void add_convolution(std::vector<ParameterShape>& all, const std::string& name, int from, int to,
                     int kernel, bool transposed, int bias_side) {
  const int first = transposed ? from : to;
  const int second = transposed ? to : from;
  all.push_back({name + ".v", {first, second, kernel, kernel}});
  all.push_back({name + ".g", transposed ? std::vector<std::int64_t>{1, to, 1, 1}
                                         : std::vector<std::int64_t>{to, 1, 1, 1}});
  all.push_back({name + ".b", bias_side > 0 ? std::vector<std::int64_t>{to, bias_side, bias_side}
                                            : std::vector<std::int64_t>{to}});
}

void add_unet(std::vector<ParameterShape>& all, const NetworkOptions& options,
              const std::string& name, int inputs) {
  const int side = branch_resolution_of(options);
  const auto bias = [&](int level) { return options.pixel_bias ? side >> level : 0; };
  add_convolution(all, name + ".first", inputs, width_of(options, 0), 3, false, bias(0));
  for (int level = 0; level < branch_levels_of(options); ++level) {
    const std::string down = name + ".down" + std::to_string(level);
    const std::string up = name + ".up" + std::to_string(level);
    const int fine = width_of(options, level);
    const int coarse = width_of(options, level + 1);
    add_convolution(all, down, fine, coarse, 4, false, bias(level + 1));
    add_convolution(all, up, coarse, fine, 4, true, bias(level));
  }
  add_convolution(all, name + ".last", width_of(options, 0) + inputs, 3, 3, false, bias(0));
}

/// The encoder of the latent code, the decoders of pose and latent code, and that of the offsets.
/// Behind the code each texel has a bias of its own: a pose is the same all over a part, and what
/// it does is not.
void add_code(std::vector<ParameterShape>& all, const NetworkOptions& options) {
  const int levels = code_levels_of(options);
  const int narrow = width_of(options, 0);
  const int side = code_resolution_of(options);
  const int flat = width_of(options, levels) * kLatentSide * kLatentSide;
  int features = 0;
  if (options.latent > 0) {
    for (int level = 0; level < levels; ++level) {
      const int fine = width_of(options, level);
      const int coarse = width_of(options, level + 1);
      add_convolution(all, "encoder.down" + std::to_string(level),
                      level == 0 ? kEncodedChannels : fine, coarse, 4, false, 0);
      add_convolution(all, "latent.up" + std::to_string(level), coarse, fine, 4, true,
                      side >> level);
    }
    add_convolution(all, "encoder.mean", flat, options.latent, 1, false, 0);
    add_convolution(all, "encoder.spread", flat, options.latent, 1, false, 0);
    add_convolution(all, "latent.first", options.latent, flat, 1, false, 0);
    features += narrow;
  }
  if (options.pose_parts > 0) {
    add_convolution(all, "pose.first", 3 * options.pose_parts, 2 * narrow, 1, false, side);
    features += 2 * narrow;
  }
  add_convolution(all, "code.join", features, narrow, 3, false, side);
  add_convolution(all, "code.last", narrow, 3, 3, false, 0);
  if (options.geometry) {
    add_convolution(all, "offset.up0", narrow, narrow, 4, true, offset_resolution_of(options));
    add_convolution(all, "offset.last", narrow, 3, 3, false, 0);
  }
}

void require_sizes(const NetworkOptions& options) {
  ATELIER_CHECK(options.resolution >= 16 && options.resolution <= 2048 &&
                    std::has_single_bit(static_cast<unsigned>(options.resolution)),
                "a network's texture has 16 to 2048 texels a side, a power of 2");
  ATELIER_CHECK(options.channels >= 1 && options.channels <= 128,
                "a network has 1 to 128 channels");
  ATELIER_CHECK(options.shading >= 1 && options.shading <= 16 &&
                    std::has_single_bit(static_cast<unsigned>(options.shading)),
                "branches are 1 to 16 times coarser than the texture, a power of 2");
  ATELIER_CHECK(!options.geometry || has_code(options),
                "a surface is moved by the code of a pose or a latent code");
}

/// Values of a parameter before training. `v`: He for LeakyReLU 0.2; `g` its length, so that the
/// convolution starts as `v` says, but the last ones 0, so that branches begin with nothing, and a
/// tenth of the code's texture, without which an encoder would not be told anything for long.
void fill_convolution(std::map<std::string, Tensor>& parameters, const ParameterShape& v,
                      Random& random) {
  const std::string name = v.name.substr(0, v.name.size() - 2);
  const bool transposed = name.find(".up") != std::string::npos;
  constexpr double kFaint = 0.1;
  const double begin = name == "code.last" ? kFaint : name.ends_with(".last") ? 0 : 1;
  const std::int64_t to = v.shape[transposed ? 1 : 0];
  const std::int64_t from = v.shape[transposed ? 0 : 1];
  const std::int64_t taps = v.shape[2] * v.shape[3];
  // Of a transposed kernel of 4 and stride 2 every output sees a quarter of the taps.
  const double inputs = static_cast<double>(from * taps) / (transposed ? 4 : 1);
  const double deviation = std::sqrt(2 / (1.04 * inputs));
  std::vector<float> values(static_cast<std::size_t>(from * to * taps));
  std::vector<double> squares(static_cast<std::size_t>(to), 0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(deviation * normal(random));
    const auto outer = static_cast<std::int64_t>(i) / taps;
    const std::int64_t channel = transposed ? outer % to : outer / from;
    squares[static_cast<std::size_t>(channel)] += static_cast<double>(values[i]) * values[i];
  }
  std::vector<float> lengths;
  lengths.reserve(squares.size());
  for (const double square : squares) {
    lengths.push_back(static_cast<float>(std::sqrt(square) * begin));
  }
  parameters[v.name] = tensor_of(values, v.shape);
  parameters[name + ".g"] = tensor_of(lengths, transposed ? std::vector<std::int64_t>{1, to, 1, 1}
                                                          : std::vector<std::int64_t>{to, 1, 1, 1});
}

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) {
    list += (list.empty() ? "" : " ") + name;
  }
  return list;
}

/// The names that list_of joined, each once.
std::vector<std::string> names_of(const std::string& list, const std::string& file) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t end = std::min(list.find(' ', at), list.size());
    names.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  const std::set<std::string> once(names.begin(), names.end());
  if (once.size() != names.size() || once.contains("")) {
    throw DataError(file, "cameras", "'" + list.substr(0, 200) + "'",
                    "names of cameras, each once, with a space between");
  }
  return names;
}

const Tensor& tensor_at(const std::map<std::string, Tensor>& tensors, const std::string& name,
                        const std::vector<std::int64_t>& shape, ElementType type,
                        const std::string& file) {
  const auto found = tensors.find(name);
  if (found == tensors.end()) {
    throw DataError(file, "tensor " + name, "nothing", shape_text(shape));
  }
  const Tensor& tensor = found->second;
  const bool fits =
      tensor.shape.size() == shape.size() &&
      std::equal(shape.begin(), shape.end(), tensor.shape.begin(),
                 [](std::int64_t wanted, std::int64_t has) { return wanted < 0 || wanted == has; });
  if (!fits || tensor.type != type) {
    throw DataError(file, "tensor " + name,
                    std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape),
                    std::string(element_type_name(type)) + " " + shape_text(shape));
  }
  check_finite(tensor, file, name);
  return tensor;
}

const std::string& text_at(const std::map<std::string, std::string>& texts, const std::string& name,
                           const std::string& file) {
  const auto found = texts.find(name);
  if (found == texts.end()) {
    throw DataError(file, name, "nothing", std::string("a network of schema ") + kModelSchema);
  }
  return found->second;
}

OptionTable describe(DrawnRange& range) {
  constexpr double kMost = 1e6;
  OptionTable table;
  table.add("low", range.low, -kMost, kMost, "", "Least share of the mean texture");
  table.add("high", range.high, -kMost, kMost, "", "Largest share of the mean texture");
  return table;
}

/// As texts "drawn.low" and "drawn.high", and back; nothing where a file has none of them.
void put_drawn(std::map<std::string, std::string>& texts, const std::optional<DrawnRange>& drawn) {
  if (drawn) {
    DrawnRange range = *drawn;
    for (const OptionField& field : describe(range).fields) {
      texts["drawn." + field.name] = option_text(field);
    }
  }
}
std::optional<DrawnRange> drawn_at(const std::map<std::string, std::string>& texts,
                                   const std::string& file) {
  if (!texts.contains("drawn.low")) {
    return std::nullopt;
  }
  DrawnRange range;
  OptionTable table = describe(range);
  for (const OptionField& field : describe(range).fields) {
    const std::string key = "drawn." + field.name;
    const std::string wrong = set_option(table, field.name, text_at(texts, key, file));
    if (!wrong.empty()) {
      throw DataError(file, key, wrong, "a share of the mean texture");
    }
  }
  return range;
}

BodyParts parts_at(const std::map<std::string, Tensor>& tensors, std::int64_t vertices, int count,
                   const std::string& file) {
  BodyParts parts;
  const auto rest =
      values_of<float>(tensor_at(tensors, "body.rest", {vertices, 3}, ElementType::Float32, file));
  parts.rest = Eigen::Map<const FloatRows>(rest.data(), vertices, 3);
  parts.part = indices_of(tensor_at(tensors, "body.part", {vertices}, ElementType::Int32, file),
                          count, file, "body.part");
  parts.parents = indices_of(tensor_at(tensors, "body.parent", {count}, ElementType::Int32, file),
                             count, file, "body.parent");
  for (const auto& [name, numbers] :
       {std::pair{"body.pose_low", &parts.low}, std::pair{"body.pose_high", &parts.high}}) {
    const auto values = values_of<float>(
        tensor_at(tensors, name, {std::int64_t{3} * count}, ElementType::Float32, file));
    numbers->assign(values.begin(), values.end());
  }
  check_body_parts(parts, file);
  return parts;
}

/// The stage that made a network: <workspace>/<stage>/<result>/<name>/model.safetensors.
std::string maker_of(const std::filesystem::path& file) {
  const std::string folder = file.parent_path().parent_path().parent_path().filename().string();
  const bool on_truth = folder == "oracle" || renamed_stage(folder) == "oracle";
  return folder == "avatar" ? "avatar" : on_truth ? "oracle" : "appearance";
}

}  // namespace

OptionTable describe(NetworkOptions& options) {
  OptionTable table;
  table.add("resolution", options.resolution, 16, 2048, "",
            "Side of the texture in texels, a power of 2");
  table.add("channels", options.channels, 1, 128, "",
            "Channels of the first level of the networks");
  table.add("view_independent", options.view_independent,
            "Branch that does not depend on the camera");
  table.add("view_dependent", options.view_dependent, "Branch that depends on the camera");
  table.add("shadow", options.shadow, "Shadow network");
  table.add("shading", options.shading, 1, 16, "",
            "Texels of the texture along one texel of the branches, a power of 2");
  table.add("transfer_degree", options.transfer_degree, 0, kLargestTransferDegree, "",
            "Degree of the spherical harmonics of the light transfer given to the networks");
  table.add("pixel_bias", options.pixel_bias, "Bias for each texel instead of each channel");
  table.add("pose_parts", options.pose_parts, 0, kMaxPoseParts, "",
            "Parts of the body whose turns the networks are given");
  table.add("latent", options.latent, 0, kMaxLatent, "", "Length of the latent code; 0: none");
  table.add("geometry", options.geometry, "Offsets of the surface by pose and latent code");
  return table;
}

int code_resolution_of(const NetworkOptions& options) {
  constexpr int kLargest = 64;
  return std::min(kLargest, branch_resolution_of(options));
}

int offset_resolution_of(const NetworkOptions& options) {
  return 2 * code_resolution_of(options);
}

int code_levels_of(const NetworkOptions& options) {
  return std::bit_width(static_cast<unsigned>(code_resolution_of(options) / kLatentSide)) - 1;
}

int shadow_resolution_of(int resolution) {
  return std::max(kMinSide, resolution / 4);
}

int branch_resolution_of(const NetworkOptions& options) {
  return std::max(2 * kMinSide, options.resolution / options.shading);
}

int branch_levels_of(const NetworkOptions& options) {
  return std::bit_width(static_cast<unsigned>(branch_resolution_of(options) / kMinSide)) - 1;
}

std::vector<ParameterShape> network_parameters(const NetworkOptions& options, int cameras) {
  require_sizes(options);
  std::vector<ParameterShape> all;
  const int transfer = transfer_terms(options.transfer_degree);
  const int geometry =
      3 + transfer + (has_code(options) ? width_of(options, 0) : 0);  // with the normal
  if (has_code(options)) {
    add_code(all, options);
  }
  constexpr int kDirection = 3;
  if (options.view_independent) {
    add_unet(all, options, "independent", geometry);
  }
  if (options.view_dependent) {
    add_unet(all, options, "dependent",
             kDirection + (options.view_independent ? width_of(options, 0) : geometry));
  }
  if (options.shadow) {
    add_convolution(all, "shadow.first", transfer, options.channels, 3, false, 0);
    add_convolution(all, "shadow.middle", options.channels, options.channels, 3, false, 0);
    add_convolution(all, "shadow.last", options.channels, 1, 3, false, 0);
  }
  all.push_back({"gain.log", {cameras, 3}});
  all.push_back({"texture.mean", {3, options.resolution, options.resolution}});
  std::sort(all.begin(), all.end(),
            [](const ParameterShape& a, const ParameterShape& b) { return a.name < b.name; });
  return all;
}

AppearanceModel initial_model(const AppearanceData& data, const NetworkOptions& options,
                              std::uint64_t seed, double smoothness) {
  require_sizes(options);
  AppearanceModel model = blank_model(data, options);
  if (options.pose_parts > 0) {
    if (!data.body || static_cast<int>(data.body->parts.parents.size()) != options.pose_parts) {
      throw DataError("", "appearance data", "a body without these parts",
                      std::to_string(options.pose_parts) + " parts, whose pose is the code");
    }
    model.parts = with_range(data.body->parts, data.frames);
  }
  std::vector<TexturePixels> pixels;
  pixels.reserve(data.views.size());
  std::vector<TextureView> views;
  for (const AppearanceView& view : data.views) {
    pixels.push_back(texture_pixels(view));
    views.push_back({view.camera_idx, &pixels.back()});
  }
  constexpr int kRounds = 6;
  StaticTexture fixed = static_texture(options.resolution, static_cast<int>(data.camera_ids.size()),
                                       views, kRounds, smoothness);
  fill_unseen(fixed, texel_map(data.faces, data.uvs, data.uv_faces, options.resolution));
  Random random{seed};
  for (const ParameterShape& parameter :
       network_parameters(options, static_cast<int>(data.camera_ids.size()))) {
    if (parameter.name.ends_with(".v")) {
      fill_convolution(model.parameters, parameter, random);
    } else if (!parameter.name.ends_with(".g")) {
      std::int64_t count = 1;
      for (const std::int64_t side : parameter.shape) {
        count *= side;
      }
      model.parameters[parameter.name] =
          tensor_of(std::vector<float>(static_cast<std::size_t>(count), 0.0F), parameter.shape);
    }
  }
  if (options.shadow) {
    model.parameters["shadow.last.b"] = tensor_of(std::vector<float>{kOpenShadow});
  }
  put_static_texture(model, std::move(fixed));
  return model;
}

std::map<std::string, Tensor> tensors_of(const AppearanceModel& model) {
  std::map<std::string, Tensor> tensors = model.parameters;
  tensors["atlas.faces"] = tensor_of(model.faces);
  tensors["atlas.uvs"] = tensor_of(model.uvs);
  tensors["atlas.uv_faces"] = tensor_of(model.uv_faces);
  tensors["static.texture"] = planes_of(model.static_texture);
  tensors["static.gain"] =
      tensor_of(model.static_gain, {static_cast<std::int64_t>(model.static_gain.size() / 3), 3});
  tensors["transfer.mean"] = tensor_of(model.mean_transfer);
  if (model.parts) {
    tensors["body.rest"] = tensor_of(model.parts->rest);
    tensors["body.part"] = tensor_of(model.parts->part);
    tensors["body.parent"] = tensor_of(model.parts->parents);
    tensors["body.pose_low"] = tensor_of(model.parts->low);
    tensors["body.pose_high"] = tensor_of(model.parts->high);
  }
  return tensors;
}

std::map<std::string, std::string> texts_of(const AppearanceModel& model) {
  NetworkOptions options = model.options;
  std::map<std::string, std::string> texts;
  texts["schema"] = kModelSchema;
  texts["version"] = kVersion;
  texts["name"] = model.name;
  texts["cameras"] = list_of(model.camera_ids);
  for (const OptionField& field : describe(options).fields) {
    texts["network." + field.name] = option_text(field);
  }
  put_occlusion(texts, model.occlusion);
  put_drawn(texts, model.drawn);
  texts[kDigestText] = content_digest(tensors_of(model), texts);
  return texts;
}

AppearanceModel appearance_model_of(const std::map<std::string, Tensor>& tensors,
                                    const std::map<std::string, std::string>& texts,
                                    const std::string& file) {
  if (const std::string& schema = text_at(texts, "schema", file); schema != kModelSchema) {
    throw DataError(file, "schema", schema.substr(0, 60), kModelSchema);
  }
  if (const std::string& version = text_at(texts, "version", file);
      version != kVersion && version != kWithoutCode) {
    throw DataError(file, "version", version.substr(0, 20),
                    std::string(kVersion) +
                        ", as this program's 'atelier appearance' makes them; "
                        "run it again");
  }
  AppearanceModel model;
  model.name = text_at(texts, "name", file);
  OptionTable table = describe(model.options);
  for (const OptionField& field : describe(model.options).fields) {
    const std::string key = "network." + field.name;
    const bool of_code =
        field.name == "pose_parts" || field.name == "latent" || field.name == "geometry";
    if (of_code && !texts.contains(key) && text_at(texts, "version", file) == kWithoutCode) {
      continue;
    }
    if (const std::string wrong = set_option(table, field.name, text_at(texts, key, file));
        !wrong.empty()) {
      throw DataError(file, key, wrong, "an architecture that there is");
    }
  }
  for (const auto& [key, value] : {std::pair{"network.resolution", model.options.resolution},
                                   std::pair{"network.shading", model.options.shading}}) {
    if (!std::has_single_bit(static_cast<unsigned>(value))) {
      throw DataError(file, key, std::to_string(value), "a power of 2");
    }
  }
  if (model.options.geometry && !has_code(model.options)) {
    throw DataError(file, "network.geometry", "true without a code", "a pose or latent code");
  }
  model.occlusion = occlusion_at(texts, file);
  model.drawn = drawn_at(texts, file);
  model.camera_ids = names_of(text_at(texts, "cameras", file), file);
  const auto count = static_cast<std::int64_t>(model.camera_ids.size());
  const int side = model.options.resolution;
  std::size_t expected = model.options.pose_parts > 0 ? 11 : 6;  // atlas, static, transfer, body
  for (const ParameterShape& parameter :
       network_parameters(model.options, static_cast<int>(count))) {
    model.parameters[parameter.name] =
        tensor_at(tensors, parameter.name, parameter.shape, ElementType::Float32, file);
    ++expected;
  }
  if (tensors.size() != expected) {
    throw DataError(file, "tensors", std::to_string(tensors.size()), std::to_string(expected));
  }
  const auto indices = [&](const std::string& name, Index below) -> Triangles {
    const Tensor& tensor = tensor_at(tensors, name, {-1, 3}, ElementType::Int32, file);
    const std::vector<int> values = indices_of(tensor, below, file, name);
    return Eigen::Map<const Triangles>(values.data(), tensor.shape[0], 3);
  };
  model.uvs = matrix_of(tensor_at(tensors, "atlas.uvs", {-1, 2}, ElementType::Float64, file), 2,
                        file, "atlas.uvs");
  check_atlas(model.uvs, file);
  constexpr Index kMaxVertices = 1 << 28;
  model.faces = indices("atlas.faces", kMaxVertices);
  model.uv_faces = indices("atlas.uv_faces", model.uvs.rows());
  if (model.faces.rows() != model.uv_faces.rows() || model.faces.rows() == 0) {
    throw DataError(file, "atlas", std::to_string(model.uv_faces.rows()) + " texture faces",
                    std::to_string(model.faces.rows()) + ", more than 0");
  }
  const auto planes = values_of<float>(
      tensor_at(tensors, "static.texture", {3, side, side}, ElementType::Float32, file));
  model.static_texture = Image(side, side, 3);
  const std::size_t texels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      model.static_texture.data[3 * i + c] = planes[c * texels + i];
    }
  }
  const auto gain =
      values_of<float>(tensor_at(tensors, "static.gain", {count, 3}, ElementType::Float32, file));
  model.static_gain.assign(gain.begin(), gain.end());
  const std::int64_t vertices = model.faces.maxCoeff() + 1;
  const Tensor& mean =
      tensor_at(tensors, "transfer.mean", {-1, kTransferTerms}, ElementType::Float32, file);
  if (mean.shape[0] < vertices) {
    throw DataError(file, "transfer.mean", shape_text(mean.shape),
                    std::to_string(vertices) + " or more, one for each vertex");
  }
  model.mean_transfer =
      Eigen::Map<const MeanTransfer>(values_of<float>(mean).data(), mean.shape[0], kTransferTerms);
  if (model.options.pose_parts > 0) {
    model.parts = parts_at(tensors, mean.shape[0], model.options.pose_parts, file);
  }
  // Last: what else is wrong says more.
  require_digest(tensors, texts, file,
                 "run 'atelier " + maker_of(file) + "' again, which recomputes it");
  return model;
}

void require_architecture(const AppearanceModel& model, const NetworkOptions& options,
                          const std::string& file) {
  NetworkOptions has = model.options;
  NetworkOptions wanted = options;
  const OptionTable has_table = describe(has);
  const OptionTable wanted_table = describe(wanted);
  for (std::size_t i = 0; i < has_table.fields.size(); ++i) {
    const std::string found = option_text(has_table.fields[i]);
    const std::string expected = option_text(wanted_table.fields[i]);
    if (found != expected) {
      throw DataError(file, has_table.fields[i].name + " of the network", found, expected);
    }
  }
}

}  // namespace atelier
