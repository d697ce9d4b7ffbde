#include "pipeline/view/view_page.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/image.h"
#include "core/io/file_bytes.h"
#include "core/io/json_text.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/saturating_cast.h"
#include "core/tree.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/view/view_assets.h"
#include "pipeline/view/view_capture.h"
#include "pipeline/view/view_data.h"

namespace atelier {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kScript = "text/javascript; charset=utf-8";
/// A file of vertices holds as many frames as fit: few enough for a jump to be quick, and enough
/// for differences between frames to be worth it.
constexpr double kChunkBytes = 5e5;
constexpr Index kMostFrames = 32;
/// Legend of the distance to the scan.
constexpr double kFarthest = 0.02;  // m

/// A layer with what its files are made of, shared by them.
struct LayerSource {
  ViewLayer layer;
  Index chunk_frames = 1;
  std::shared_ptr<const LayerSource> scans;  ///< that distances are measured to, or null
  Index frames() const { return frame_count(layer.sequence); }
  bool one_topology() const { return layer.sequence.faces.rows() > 0; }
  Index chunks() const { return (frames() + chunk_frames - 1) / chunk_frames; }
};

std::vector<std::uint32_t> indices_of(const Triangles& faces) {
  std::vector<std::uint32_t> indices;
  indices.reserve(static_cast<std::size_t>(faces.size()));
  for (Index f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      indices.push_back(static_cast<std::uint32_t>(faces(f, k)));
    }
  }
  return indices;
}

std::vector<float> floats_of(const Points2& points) {
  std::vector<float> floats;
  floats.reserve(static_cast<std::size_t>(points.size()));
  for (Index i = 0; i < points.rows(); ++i) {
    floats.push_back(static_cast<float>(points(i, 0)));
    floats.push_back(static_cast<float>(points(i, 1)));
  }
  return floats;
}

/// Runs `fill`; a frame that is missing or damaged is a line of `missing` in the header.
void tell_missing(ViewData& data, int frame_id, const std::function<void()>& fill) {
  if (const auto problem = problem_of(fill)) {
    data.header["missing"].push_back({{"frame", frame_id}, {"why", *problem}});
  }
}

void add_topology(ViewData& data, const ViewLayer& layer) {
  data.add<std::uint32_t>("faces", indices_of(layer.sequence.faces));
  if (layer.shared.uv_faces.rows() == layer.sequence.faces.rows() && layer.texture) {
    data.add<std::uint32_t>("uv_faces", indices_of(layer.shared.uv_faces));
    data.add<float>("uvs", floats_of(layer.shared.uvs));
  }
  if (layer.rest) {
    data.add<float>("rest", inverse_rest_edges(layer.rest->vertices, layer.rest->faces));
  }
  if (layer.pattern) {
    data.add<std::uint32_t>("pattern_faces", indices_of(layer.pattern->uv_faces));
    data.add<float>("pattern", floats_of(layer.pattern->uvs));
  }
}

void append_confidence(const Mesh& mesh, std::vector<std::uint8_t>& bytes) {
  for (Index v = 0; v < mesh.confidence.size(); ++v) {
    bytes.push_back(saturating_cast<std::uint8_t>(std::round(255 * mesh.confidence[v])));
  }
}

/// What a scan says of its vertices beside their places.
void add_attributes(ViewData& data, const Mesh& mesh) {
  std::vector<std::uint8_t> confidence;
  append_confidence(mesh, confidence);
  if (!confidence.empty()) {
    data.add<std::uint8_t>("confidence", confidence);
  }
  if (mesh.colors.rows() > 0) {
    Image linear(static_cast<int>(mesh.colors.rows()), 1, 3);
    std::copy_n(mesh.colors.data(), mesh.colors.size(), linear.data.begin());
    data.add<std::uint8_t>("colors", srgb_from_linear(linear).data);
  }
  if (!mesh.labels.empty()) {
    data.add<std::uint8_t>("labels", mesh.labels);
  }
}

/// Frames of one topology.
std::string vertex_chunk(const std::string& key, const LayerSource& source, Index chunk) {
  const Sequence& sequence = source.layer.sequence;
  const Index first = chunk * source.chunk_frames;
  const Index end = std::min(first + source.chunk_frames, source.frames());
  ViewData data;
  std::vector<Points> frames(static_cast<std::size_t>(end - first));
  std::vector<std::uint8_t> confidence;
  Points known = Points::Zero(sequence.faces.maxCoeff() + 1, 3);
  bool is_known = false;
  for (Index i = first; i < end; ++i) {
    const int id = sequence.frame_ids[static_cast<std::size_t>(i)];
    tell_missing(data, id, [&] {
      const Mesh mesh = frame(sequence, i);
      if (is_known && mesh.vertices.rows() != known.rows()) {
        throw DataError("", "frame " + std::to_string(id),
                        std::to_string(mesh.vertices.rows()) + " vertices",
                        std::to_string(known.rows()) + ", as in the frame before");
      }
      frames[static_cast<std::size_t>(i - first)] = known = mesh.vertices;
      is_known = true;
      append_confidence(mesh, confidence);
    });
  }
  for (Points& one : frames) {  // a page shows no frame that is missing, but it has a place
    one = one.rows() == 0 ? known : one;
  }
  data.header["frames"] = end - first;
  add_vertices(data, quantize(frames));
  if (confidence.size() == frames.size() * static_cast<std::size_t>(frames.front().rows())) {
    data.add<std::uint8_t>("confidence", confidence);
  }
  return data.script(key);
}

/// One scan, with faces of its own.
std::string scan_chunk(const std::string& key, const LayerSource& source, Index index) {
  const Sequence& sequence = source.layer.sequence;
  ViewData data;
  data.header["frames"] = 1;
  tell_missing(data, sequence.frame_ids[static_cast<std::size_t>(index)], [&] {
    const Mesh mesh = frame(sequence, index);
    add_vertices(data, quantize(std::span(&mesh.vertices, 1)));
    data.add<std::uint32_t>("faces", indices_of(mesh.faces));
    add_attributes(data, mesh);
  });
  return data.script(key);
}

/// How far each vertex is from the scan of its frame.
std::string distance_chunk(const std::string& key, const LayerSource& source, Index chunk) {
  const Sequence& sequence = source.layer.sequence;
  const Sequence& scans = source.scans->layer.sequence;
  const Index first = chunk * source.chunk_frames;
  const Index end = std::min(first + source.chunk_frames, source.frames());
  ViewData data;
  std::vector<std::uint8_t> all;
  for (Index i = first; i < end; ++i) {
    const int id = sequence.frame_ids[static_cast<std::size_t>(i)];
    std::vector<double> distances;
    tell_missing(data, id, [&] {
      const auto at = std::lower_bound(scans.frame_ids.begin(), scans.frame_ids.end(), id);
      const Mesh mesh = frame(sequence, i);
      distances.assign(static_cast<std::size_t>(mesh.vertices.rows()), 0);
      if (at == scans.frame_ids.end() || *at != id) {
        throw DataError("", "frame " + std::to_string(id), "no scan", "a scan of the frame");
      }
      const Mesh scan = frame(scans, at - scans.frame_ids.begin());
      const std::vector<ClosestPoint> nearest =
          closest_points(build_tree(scan.vertices, scan.faces), mesh.vertices, kFarthest);
      for (std::size_t v = 0; v < nearest.size(); ++v) {
        distances[v] = std::min(std::sqrt(nearest[v].squared_distance), kFarthest);
      }
    });
    distances.resize(static_cast<std::size_t>(sequence.faces.maxCoeff()) + 1, 0);
    const std::vector<std::uint8_t> bytes = to_bytes(distances, 0, kFarthest);
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  data.header["frames"] = end - first;
  data.add<std::uint8_t>("values", all);
  return data.script(key);
}

/// Puts a layer's files on the page and tells what they are.
Json put_layer(ViewPage& page, const std::shared_ptr<const LayerSource>& source,
               const std::string& folder) {
  const ViewLayer& layer = source->layer;
  Json json{{"name", printable(layer.name)},
            {"stage", layer.stage},
            {"role", layer.role},
            {"shown", layer.shown},
            {"fps", layer.sequence.fps},
            {"data", folder},
            {"frames", layer.sequence.frame_ids},
            {"chunk", source->chunk_frames},
            {"topology", source->one_topology()}};
  if (!layer.begins.empty()) {
    json["begins"] = layer.begins;
  }
  const auto put = [&](const std::string& name,
                       std::function<std::string(const std::string&)> make) {
    put_data(page, folder + "/" + name, std::move(make));
  };
  if (source->one_topology()) {
    put("topology", [source](const std::string& key) {
      ViewData data;
      add_topology(data, source->layer);
      return data.script(key);
    });
    json["strain"] = layer.rest.has_value();
    json["pattern"] = layer.pattern.has_value();
    json["vertices"] = layer.sequence.faces.maxCoeff() + 1;
  }
  for (Index chunk = 0; chunk < source->chunks(); ++chunk) {
    put(std::to_string(chunk), [source, chunk](const std::string& key) {
      return source->one_topology() ? vertex_chunk(key, *source, chunk)
                                    : scan_chunk(key, *source, chunk);
    });
    if (source->scans) {
      put("distance/" + std::to_string(chunk),
          [source, chunk](const std::string& key) { return distance_chunk(key, *source, chunk); });
    }
  }
  if (source->scans) {
    json["distance"] = {{"high", kFarthest}};
  }
  if (layer.texture) {
    put("texture", [source](const std::string& key) {
      ViewData data;
      tell_missing(data, 0, [&] { data.header["image"] = image_address(*source->layer.texture); });
      return data.script(key);
    });
    json["texture"] = true;
  }
  return json;
}

Json json_of(const ViewSeries& series) {
  Json values = Json::array();
  for (const double value : series.values) {
    values.push_back(std::isfinite(value) ? Json(value) : Json(nullptr));
  }
  return {{"name", printable(series.name)},
          {"stage", series.stage},
          {"frames", series.frame_ids},
          {"values", std::move(values)}};
}

Json json_of(const ViewMark& mark) {
  Json json{{"severity", severity_name(mark.severity)},
            {"text", printable(mark.text)},
            {"stage", mark.stage}};
  if (mark.frame_id) {
    json["frame"] = *mark.frame_id;
  }
  if (!mark.camera.empty()) {
    json["camera"] = mark.camera;
  }
  return json;
}

Json json_of(const ViewTake& take) {
  return {{"name", printable(take.name)}, {"fps", take.fps}, {"first", take.first}};
}

Index frames_of_a_chunk(const Sequence& sequence) {
  if (sequence.faces.rows() == 0) {
    return 1;
  }
  const double bytes = 6.0 * (sequence.faces.maxCoeff() + 1);
  return std::clamp(static_cast<Index>(kChunkBytes / bytes), Index{1}, kMostFrames);
}

Json put_timeline(ViewPage& page, ViewTimeline timeline, const std::string& folder,
                  const ViewPageOptions& options) {
  Json json{{"name", printable(timeline.name)}, {"frames", timeline.frame_ids}};
  json["takes"] = Json::array();
  for (const ViewTake& take : timeline.takes) {
    json["takes"].push_back(json_of(take));
  }
  json["layers"] = Json::array();
  std::shared_ptr<const LayerSource> scans;
  for (ViewLayer& layer : timeline.layers) {
    const auto source = std::make_shared<LayerSource>();
    source->layer = std::move(layer);
    source->chunk_frames = frames_of_a_chunk(source->layer.sequence);
    if (source->one_topology() && source->layer.role != "body") {
      source->scans = scans;
    }
    json["layers"].push_back(
        put_layer(page, source, folder + "/" + std::to_string(json["layers"].size())));
    if (source->layer.role == "scan") {
      scans = source;
    }
  }
  json["series"] = Json::array();
  for (const ViewSeries& series : timeline.series) {
    json["series"].push_back(json_of(series));
  }
  json["marks"] = Json::array();
  for (const ViewMark& mark : timeline.marks) {
    json["marks"].push_back(json_of(mark));
  }
  json["videos"] = Json::array();
  for (const std::filesystem::path& video : timeline.videos) {
    const std::string name = folder + "/video" + std::to_string(json["videos"].size()) + ".mp4";
    page[name] = {"video/mp4", {}, video};
    json["videos"].push_back(name);
  }
  if (timeline.capture) {
    json["capture"] =
        put_capture(page, std::move(*timeline.capture), std::move(timeline.keypoints3d),
                    timeline.frame_ids, folder + "/capture", options);
  }
  return json;
}

}  // namespace

OptionTable describe(ViewPageOptions& options) {
  OptionTable table;
  table.add("image_width", options.image_width, 64, 16384, "pixels",
            "Width of the cameras' images on the page, at most; larger ones are reduced");
  return table;
}

void put_data(ViewPage& page, const std::string& key,
              std::function<std::string(const std::string& key)> make) {
  page[key + ".js"] = {kScript, [key, make = std::move(make)] { return make(key); }, {}};
}

ViewPage view_page(ViewScene scene, const ViewPageOptions& options) {
  if (scene.timelines.empty()) {
    throw LogicError("a page needs something to show");
  }
  ViewPage page;
  for (const ViewAsset& asset : view_assets()) {
    page[std::string(asset.name)] = {
        std::string(asset.type), [bytes = asset.bytes] { return std::string(bytes); }, {}};
  }
  Json json{{"title", printable(scene.title)}, {"timelines", Json::array()}};
  for (ViewTimeline& timeline : scene.timelines) {
    const std::string folder = "data/" + std::to_string(json["timelines"].size());
    json["timelines"].push_back(put_timeline(page, std::move(timeline), folder, options));
  }
  json["beside"] = scene.beside;
  json["notes"] = Json::array();
  for (const std::string& note : scene.notes) {
    json["notes"].push_back(printable(note));
  }
  page["scene.js"] = {
      kScript, [text = "atelierScene(" + json_text(json) + ");\n"] { return text; }, {}};
  return page;
}

}  // namespace atelier
