#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/printable.h"
#include "apps/stage_console.h"
#include "apps/usage_error.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "core/io/npy.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/mesh_statistics.h"
#include "core/store/file_kind.h"
#include "core/store/manifest.h"
#include "core/store/result.h"
#include "core/topology.h"

namespace atelier {
namespace {

/// What a file is, as facts in order; findings are what is wrong with it.
struct Inspection {
  std::vector<std::pair<std::string, std::string>> facts;
  std::vector<Finding> findings;

  void add(const std::string& name, const std::string& value) { facts.emplace_back(name, value); }
};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string point(const Eigen::Vector3d& p) {
  return number(p.x()) + " " + number(p.y()) + " " + number(p.z());
}

void inspect_mesh(const std::filesystem::path& path, Inspection& inspection) {
  const Mesh mesh = read_mesh(path);
  const MeshStatistics s = mesh_statistics(mesh);
  inspection.add("kind", "mesh");
  inspection.add("unit", "metres, Y up (as the file says, or else taken for it)");
  inspection.add("vertices", std::to_string(s.vertices));
  inspection.add("triangles", std::to_string(s.faces));
  inspection.add("edges", std::to_string(s.edges));
  inspection.add("components", std::to_string(s.components));
  inspection.add("boundary loops", std::to_string(s.boundary_loops));
  inspection.add("lowest", point(s.lowest));
  inspection.add("highest", point(s.highest));
  inspection.add("area", number(s.area) + " m2");
  inspection.add("volume", s.volume ? number(*s.volume) + " m3" : "none: it is not closed");
  if (!s.edge_lengths.empty()) {
    inspection.add("edge length",
                   number(s.edge_lengths.front()) + " to " + number(s.edge_lengths.back()) + " m");
  }
  std::string attributes;
  const auto attribute = [&](const char* name, bool there) {
    attributes += there ? (attributes.empty() ? "" : ", ") + std::string(name) : "";
  };
  attribute("normals", mesh.normals.rows() > 0);
  attribute("colours", mesh.colors.rows() > 0);
  attribute("texture coordinates", mesh.uvs.rows() > 0);
  attribute("labels", !mesh.labels.empty());
  attribute("confidence", mesh.confidence.size() > 0);
  inspection.add("attributes", attributes.empty() ? "none" : attributes);
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  inspection.findings = findings_of(manifold_defects(topology), topology);
}

std::string tensor_text(const Tensor& tensor) {
  std::string text = std::string(element_type_name(tensor.type)) + " " + shape_text(tensor.shape);
  if (tensor.type == ElementType::Text || tensor.type == ElementType::Complex64 ||
      tensor.type == ElementType::Complex128) {
    return text;
  }
  const std::vector<double> values = doubles_of(tensor);
  double least = 0;
  double most = 0;
  std::int64_t finite = 0;
  for (const double value : values) {
    if (std::isfinite(value)) {
      least = finite == 0 ? value : std::min(least, value);
      most = finite == 0 ? value : std::max(most, value);
      ++finite;
    }
  }
  if (finite > 0) {
    text += ", " + number(least) + " to " + number(most);
  }
  const auto rest = static_cast<std::int64_t>(values.size()) - finite;
  return text + (rest > 0 ? ", " + std::to_string(rest) + " not finite" : "");
}

void inspect_npz(const std::filesystem::path& path, Inspection& inspection) {
  const Npz npz(path);
  inspection.add("kind", "npz, " + std::to_string(npz.names().size()) + " arrays");
  for (const std::string& name : npz.names()) {
    inspection.add(name, tensor_text(npz.read(name)));
  }
}

void inspect_safetensors(const std::filesystem::path& path, Inspection& inspection) {
  const Safetensors content = read_safetensors(path);
  inspection.add("kind", "safetensors, " + std::to_string(content.tensors.size()) + " tensors");
  for (const auto& [name, text] : content.metadata) {
    inspection.add(name, "'" + text.substr(0, 80) + "'");
  }
  for (const auto& [name, tensor] : content.tensors) {
    inspection.add(name, tensor_text(tensor));
  }
}

void inspect_manifest(const std::filesystem::path& path, Inspection& inspection) {
  const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
  const Manifest manifest = parse_manifest(
      read_json(path).dump(), path.string());  // its own digest is of the content, not the layout
  inspection.add("kind", "manifest of a result of '" + manifest.stage + "', version " +
                             std::to_string(manifest.stage_version));
  inspection.add("key", hex(manifest.key));
  inspection.add("finished", manifest.finished);
  inspection.add("build", manifest.build);
  inspection.add("work", duration_text(manifest.work_seconds) + ", " +
                             bytes_text(static_cast<double>(manifest.peak_memory_bytes)) +
                             " of memory");
  inspection.add("consent", to_string(manifest.consent));
  for (const ManifestInput& input : manifest.inputs) {
    inspection.add("input " + input.kind, input.path + ", " + std::to_string(input.files) +
                                              " files, " +
                                              bytes_text(static_cast<double>(input.bytes)));
  }
  for (const ManifestOption& option : manifest.options) {
    inspection.add("option " + option.name, option.json + " (" + option.source + ")");
  }
  for (const auto& [name, value] : manifest.metrics) {
    inspection.add("metric " + name, number(value));
  }
  inspection.add("outputs", std::to_string(manifest.outputs.size()) + " files");
  inspection.findings = check_outputs(folder, manifest, Check::Digests);
}

void inspect_json(const std::filesystem::path& path, Inspection& inspection) {
  const nlohmann::json json = read_json(path);
  if (json.is_object() && json.value("schema", nlohmann::json()) == "atelier-manifest") {
    inspect_manifest(path, inspection);
    return;
  }
  inspection.add("kind", std::string("JSON, ") + json.type_name());
  if (json.is_object() && json.contains("schema") && json["schema"].is_string()) {
    inspection.add("schema", json["schema"].get<std::string>());
  }
  if (json.is_structured()) {
    inspection.add("entries", std::to_string(json.size()));
  }
}

void inspect_image(const std::filesystem::path& path, Inspection& inspection) {
  const ImageHeader header = read_image_header(path);
  inspection.add("kind", std::string("image, ") + format_name(header.format));
  inspection.add("pixels", std::to_string(header.width) + " x " + std::to_string(header.height));
  inspection.add("channels", std::to_string(header.channels) + " of " +
                                 std::to_string(header.bit_depth) + " bits" +
                                 (header.palette ? ", by palette" : ""));
  const Image image = read_image(path);  // a damaged file is refused here
  std::vector<float> low(static_cast<std::size_t>(image.channels), 1.0f);
  std::vector<float> high(low.size(), 0.0f);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    low[i % low.size()] = std::min(low[i % low.size()], image.data[i]);
    high[i % low.size()] = std::max(high[i % low.size()], image.data[i]);
  }
  for (std::size_t c = 0; c < low.size(); ++c) {
    inspection.add("channel " + std::to_string(c),
                   number(low[c]) + " to " + number(high[c]) + ", linear");
  }
  if (header.orientation != 1) {
    inspection.findings.push_back(
        {Severity::Warning, "image-orientation", path.string(),
         "EXIF orientation " + std::to_string(header.orientation) + " is not applied",
         "store the pixels as the camera was calibrated"});
  }
}

void inspect_archive(const std::filesystem::path& path, Inspection& inspection) {
  const Archive archive = archive_contents(path);
  inspection.add("kind", "archive of schema '" + archive.schema + "', version " +
                             std::to_string(archive.version));
  inspection.add("units", archive.units + ", up " + archive.up_axis);
  for (const auto& [name, value] : archive.numbers) {
    inspection.add(name, number(value));
  }
  for (const auto& [name, text] : archive.texts) {
    inspection.add(name, "'" + text.substr(0, 80) + "'");
  }
  // With data: damage is found, and ranges can be told.
  const Archive whole = read_archive(path, archive.schema, archive.version);
  for (const auto& [name, tensor] : whole.datasets) {
    inspection.add(name, tensor_text(tensor));
  }
}

struct Kind {
  const char* extension;
  void (*inspect)(const std::filesystem::path& path, Inspection& inspection);
};

constexpr Kind kKinds[] = {
    {".obj", inspect_mesh},
    {".ply", inspect_mesh},
    {".glb", inspect_mesh},
    {".gltf", inspect_mesh},
    {".npz", inspect_npz},
    {".npy",
     [](const std::filesystem::path& path, Inspection& inspection) {
       inspection.add("kind", "npy");
       inspection.add("array", tensor_text(read_npy(path)));
     }},
    {".png", inspect_image},
    {".jpg", inspect_image},
    {".jpeg", inspect_image},
    {".tif", inspect_image},
    {".tiff", inspect_image},
    {".webp", inspect_image},
    {".bmp", inspect_image},
    {".avif", inspect_image},
    {".safetensors", inspect_safetensors},
    {".h5", inspect_archive},
    {".json", inspect_json},
};

double size_of(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    throw EnvironmentError(path.string(), error.message());
  }
  return static_cast<double>(size);
}

Inspection inspect(const std::filesystem::path& path) {
  const std::filesystem::file_type there = file_kind(path);
  if (there == std::filesystem::file_type::not_found) {
    throw DataError(path.string(), "", "nothing there", "a file");
  }
  if (there == std::filesystem::file_type::directory) {
    throw DataError(path.string(), "", "a folder",
                    "a file; atelier status shows what a workspace holds");
  }
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  std::string known;
  for (const Kind& kind : kKinds) {
    if (extension == kind.extension) {
      Inspection inspection;
      inspection.add("file", path.string());
      inspection.add("size", bytes_text(size_of(path)));
      kind.inspect(path, inspection);
      return inspection;
    }
    known += (known.empty() ? "" : ", ") + std::string(kind.extension);
  }
  throw DataError(path.string(), "", "a kind of file that is not known", "one of " + known);
}

int run(const std::string& file, bool as_json) {
  if (file.empty()) {
    throw UsageError("it takes a FILE: atelier inspect FILE");
  }
  const Inspection inspection = inspect(file);
  const int code = has_errors(inspection.findings) ? kExitBadData : kExitDone;
  if (as_json) {
    nlohmann::json json = nlohmann::json::object();
    for (const auto& [name, value] : inspection.facts) {
      json[name] = value;
    }
    json["findings"] = nlohmann::json::array();
    for (const Finding& finding : inspection.findings) {
      json["findings"].push_back({{"severity", severity_name(finding.severity)},
                                  {"code", finding.code},
                                  {"place", finding.place},
                                  {"what", finding.what}});
    }
    std::cout << json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
    return code;
  }
  for (const auto& [name, value] : inspection.facts) {
    std::string column = printable(name);
    column.resize(std::max<std::size_t>(name.size() + 2, 18), ' ');
    std::cout << column << printable(value) << "\n";
  }
  for (const Finding& finding : inspection.findings) {
    std::cout << printable(to_string(finding)) << "\n";
  }
  return code;
}

}  // namespace

Action add_inspect(CLI::App& parser) {
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  parser
      .add_option("FILE", *file,
                  "Mesh, image, npy, npz, safetensors, archive, JSON or a result's manifest.json")
      ->required();
  parser.add_flag("--json", *json, "For machines");
  return [file, json] { return run(*file, *json); };
}

}  // namespace atelier
