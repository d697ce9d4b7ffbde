#include "core/store/manifest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "core/io/json.h"
#include "core/printable.h"
#include "core/renamed_options.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr const char* kSchema = "atelier-manifest";
constexpr int kSchemaVersion = 4;    // 1: without warnings, 2: without sketches
constexpr int kUnsignedVersion = 3;  // what is written where no consent has a field of the fourth

/// Fields of a consent that the fourth version has, where they say something.
constexpr std::array<std::pair<const char*, std::string Consent::*>, 3> kSignedConsent = {
    {{"revocation", &Consent::revocation},
     {"key", &Consent::key},
     {"signature", &Consent::signature}}};

bool needs_newest(const Manifest& manifest) {
  return std::any_of(manifest.consent.begin(), manifest.consent.end(), [](const Consent& one) {
    return std::any_of(kSignedConsent.begin(), kSignedConsent.end(),
                       [&](const auto& field) { return !(one.*field.second).empty(); });
  });
}
constexpr const char* kSelf = "manifest_sha256";

/// One JSON object that is read field by field, each asked for by name and type.
class ObjectReader {
 public:
  ObjectReader(const nlohmann::json& object, const std::string& file, std::string place)
      : object_(object), file_(file), place_(std::move(place)) {
    if (!object_.is_object()) {
      refuse(place_, object_.type_name(), "an object");
    }
  }
  /// Nothing may be there that nobody asked for.
  void finish() const {
    for (const auto& item : object_.items()) {
      if (!asked_.contains(item.key())) {
        refuse(named(item.key().substr(0, 80)), "an unknown field", "none of that name");
      }
    }
  }

  bool has(const char* name) const { return object_.contains(name); }
  std::string text(const char* name) {
    const nlohmann::json& value = field(name);
    if (!value.is_string()) {
      refuse(named(name), value.type_name(), "a string");
    }
    std::string result = value.get<std::string>();
    if (!is_printable_utf8(result)) {
      refuse(named(name), "control characters", "printable text");
    }
    return result;
  }
  std::int64_t count(const char* name) {
    const nlohmann::json& value = field(name);
    const bool fits = value.is_number_unsigned()
                          ? value.get<std::uint64_t>() <= (std::uint64_t{1} << 62)
                          : value.is_number_integer() && value.get<std::int64_t>() >= 0;
    if (!fits) {
      refuse(named(name), value.dump(), "an integer from 0 to 2^62");
    }
    return value.get<std::int64_t>();
  }
  double number(const char* name) {
    const nlohmann::json& value = field(name);
    if (!value.is_number()) {
      refuse(named(name), value.type_name(), "a number");
    }
    return value.get<double>();
  }
  bool flag(const char* name) {
    const nlohmann::json& value = field(name);
    if (!value.is_boolean()) {
      refuse(named(name), value.type_name(), "true or false");
    }
    return value.get<bool>();
  }
  Digest digest(const char* name) {
    const std::string digits = text(name);
    const auto result = digest_from_hex(digits);
    if (!result) {
      refuse(named(name), "'" + digits.substr(0, 70) + "'", "64 lower-case hexadecimal digits");
    }
    return *result;
  }
  const nlohmann::json& array(const char* name) {
    const nlohmann::json& value = field(name);
    if (!value.is_array()) {
      refuse(named(name), value.type_name(), "an array");
    }
    return value;
  }
  const nlohmann::json& object(const char* name) {
    const nlohmann::json& value = field(name);
    if (!value.is_object()) {
      refuse(named(name), value.type_name(), "an object");
    }
    return value;
  }
  const nlohmann::json& field(const char* name) {
    asked_.insert(name);
    const auto found = object_.find(name);
    if (found == object_.end()) {
      refuse(named(name), "nothing", "this field");
    }
    return *found;
  }
  std::string named(const std::string& name) const {
    return place_.empty() ? name : place_ + "." + name;
  }
  [[noreturn]] void refuse(const std::string& where, const std::string& found,
                           const std::string& expected) const {
    throw DataError(file_, where, found, expected);
  }

 private:
  const nlohmann::json& object_;
  const std::string& file_;
  std::string place_;
  std::set<std::string> asked_;
};

nlohmann::json to_json(const Manifest& manifest) {
  nlohmann::json json;
  json["schema"] = kSchema;
  json["schema_version"] = needs_newest(manifest) ? kSchemaVersion : kUnsignedVersion;
  json["stage"] = manifest.stage;
  json["stage_version"] = manifest.stage_version;
  json["device"] = manifest.device;
  json["key"] = hex(manifest.key);
  json["options"] = nlohmann::json::array();
  for (const ManifestOption& option : manifest.options) {
    json["options"].push_back({{"name", option.name},
                               {"value", parse_json(option.json, option.name)},
                               {"source", option.source},
                               {"keyed", option.keyed}});
  }
  json["canonical_options"] = manifest.canonical_options;
  json["inputs"] = nlohmann::json::array();
  for (const ManifestInput& input : manifest.inputs) {
    json["inputs"].push_back({{"kind", input.kind},
                              {"path", input.path},
                              {"digest", hex(input.digest)},
                              {"files", input.files},
                              {"bytes", input.bytes},
                              {"stage", input.stage},
                              {"stamp", hex(input.stamp)},
                              {"sketch", sketch_text(input.sketch)}});
  }
  json["outputs"] = nlohmann::json::array();
  for (const ManifestOutput& output : manifest.outputs) {
    json["outputs"].push_back(
        {{"path", output.path}, {"size", output.size}, {"sha256", hex(output.digest)}});
  }
  json["consent"] = nlohmann::json::array();
  for (const Consent& consent : manifest.consent) {
    json["consent"].push_back(
        {{"who", consent.who}, {"scope", consent.scope}, {"until", consent.until}});
    for (const auto& [name, field] : kSignedConsent) {
      if (!(consent.*field).empty()) {
        json["consent"].back()[name] = consent.*field;
      }
    }
  }
  json["metrics"] = nlohmann::json::object();
  for (const auto& [name, value] : manifest.metrics) {
    ATELIER_CHECK(std::isfinite(value), "metric " + name + " is not finite");
    json["metrics"][name] = value;
  }
  json["warnings"] = manifest.warnings;
  json["build"] = manifest.build;
  json["started"] = manifest.started;
  json["finished"] = manifest.finished;
  json["work_seconds"] = manifest.work_seconds;
  json["peak_memory_bytes"] = manifest.peak_memory_bytes;
  return json;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

std::string numbered(const char* name, std::size_t i) {
  return std::string(name) + "[" + std::to_string(i) + "]";
}

/// The items of an array of objects: `read` takes the fields of one; more fields are refused.
template <class Item, class Read>
std::vector<Item> read_items(ObjectReader& manifest, const char* name, const std::string& file,
                             const Read& read) {
  std::vector<Item> items;
  for (const auto& value : manifest.array(name)) {
    ObjectReader reader(value, file, numbered(name, items.size()));
    Item item = read(reader);
    reader.finish();
    items.push_back(std::move(item));
  }
  return items;
}

std::vector<ManifestOption> read_options(ObjectReader& manifest, const std::string& file) {
  std::set<std::string> names;
  return read_items<ManifestOption>(manifest, "options", file, [&](ObjectReader& reader) {
    ManifestOption option;
    option.name = reader.text("name");
    option.json = reader.field("value").dump();
    option.source = reader.text("source");
    option.keyed = reader.flag("keyed");
    if (!names.insert(option.name).second) {
      reader.refuse(reader.named("name"), "'" + option.name + "' twice", "each option once");
    }
    return option;
  });
}

std::vector<ManifestInput> read_inputs(ObjectReader& manifest, const std::string& file) {
  return read_items<ManifestInput>(manifest, "inputs", file, [](ObjectReader& reader) {
    ManifestInput input;
    input.kind = reader.text("kind");
    input.path = reader.text("path");
    input.digest = reader.digest("digest");
    input.files = reader.count("files");
    input.bytes = reader.count("bytes");
    input.stage = reader.text("stage");
    if (reader.has("stamp")) {  // older manifests have none
      input.stamp = reader.digest("stamp");
    }
    if (reader.has("sketch") && !parse_sketch(reader.text("sketch"), input.sketch)) {
      reader.refuse(reader.named("sketch"), "'" + reader.text("sketch").substr(0, 70) + "'",
                    "numbers of 16 lower-case hexadecimal digits, increasing");
    }
    return input;
  });
}

std::vector<ManifestOutput> read_outputs(ObjectReader& manifest, const std::string& file) {
  std::set<std::string> paths;
  std::string before;
  return read_items<ManifestOutput>(manifest, "outputs", file, [&](ObjectReader& reader) {
    ManifestOutput output;
    output.path = reader.text("path");
    output.size = reader.count("size");
    output.digest = reader.digest("sha256");
    if (!is_safe_output_path(output.path)) {
      reader.refuse(reader.named("path"), "'" + output.path.substr(0, 80) + "'",
                    "a relative path of [A-Za-z0-9._-] without '..'");
    }
    if (output.path == "manifest.json") {
      reader.refuse(reader.named("path"), "the manifest itself", "outputs alone");
    }
    if (!paths.insert(lower(output.path)).second) {
      reader.refuse(reader.named("path"), "'" + output.path + "' twice (letter case aside)",
                    "each output once");
    }
    if (output.path < before) {
      reader.refuse(reader.named("path"), "'" + output.path + "' out of order",
                    "outputs sorted by path");
    }
    before = output.path;
    return output;
  });
}

std::vector<Consent> consent_of(ObjectReader& manifest, const std::string& file) {
  return read_items<Consent>(manifest, "consent", file, [](ObjectReader& reader) {
    Consent one;
    one.who = reader.text("who");
    one.scope = reader.text("scope");
    one.until = reader.text("until");
    for (const auto& [name, field] : kSignedConsent) {
      if (reader.has(name)) {
        one.*field = reader.text(name);
      }
    }
    return one;
  });
}

std::vector<std::string> read_warnings(ObjectReader& manifest) {
  std::vector<std::string> warnings;
  for (const nlohmann::json& item : manifest.array("warnings")) {
    const std::string place = "warnings." + std::to_string(warnings.size());
    if (!item.is_string()) {
      manifest.refuse(place, item.type_name(), "a string");
    }
    warnings.push_back(item.get<std::string>());
    if (!is_printable_utf8(warnings.back())) {
      manifest.refuse(place, "control characters", "printable text");
    }
    if (warnings.size() > kMaxWarnings) {
      manifest.refuse("warnings", "more", "at most " + std::to_string(kMaxWarnings));
    }
  }
  return warnings;
}

std::map<std::string, double> read_metrics(ObjectReader& manifest) {
  std::map<std::string, double> metrics;
  for (const auto& item : manifest.object("metrics").items()) {
    if (!item.value().is_number()) {
      manifest.refuse("metrics." + item.key(), item.value().type_name(), "a number");
    }
    metrics[present_metric(item.key())] = item.value().get<double>();
  }
  return metrics;
}

/// The key must be made of the options as they are listed.
void check_canonical_options(const Manifest& manifest, const std::string& file) {
  nlohmann::json keyed = nlohmann::json::object();
  for (const ManifestOption& option : manifest.options) {
    if (option.keyed) {
      keyed[option.name] = parse_json(option.json, file);
    }
  }
  if (parse_json(manifest.canonical_options, file) != keyed) {
    throw DataError(file, "canonical_options", "other values than under options",
                    "the keyed options");
  }
}

}  // namespace

Digest stage_key(std::string_view stage, int stage_version, std::string_view device,
                 std::string_view options, const std::vector<ManifestInput>& inputs) {
  Sha256 hash;
  // Each part is led by its length, so that no two lists of parts give the same bytes.
  const auto part = [&](std::string_view text) {
    hash.update(std::to_string(text.size()) + ":");
    hash.update(text);
  };
  part("atelier-stage-key-1");
  part(stage);
  part(std::to_string(stage_version));
  part(device);
  part(options);
  for (const ManifestInput& input : inputs) {
    part(input.kind);
    part(hex(input.digest));
  }
  return hash.finish();
}

bool is_same_input(const ManifestInput& a, const ManifestInput& b) {
  return a.digest == b.digest || a.path == b.path || holds_mostly(a.sketch, b.sketch) ||
         holds_mostly(b.sketch, a.sketch);
}

std::string input_difference(const ManifestInput& there, const ManifestInput& here) {
  std::string text = amount_text(there.files, there.bytes) + " there, " +
                     amount_text(here.files, here.bytes) + " here";
  const SharedFiles files = shared_files(there.sketch, here.sketch);
  if (files.compared > 0) {
    text += "; of " + counted(static_cast<std::int64_t>(files.compared), "file") + " there that " +
            (files.compared == 1 ? "was" : "were") + " compared " +
            (files.shared == 0 ? "none" : std::to_string(files.shared)) +
            (files.shared > 1 ? " are here" : " is here");
  }
  return text;
}

std::string amount_text(std::int64_t files, std::int64_t bytes) {
  return counted(files, "file") + ", " + std::to_string(bytes) + " bytes";
}

Digest outputs_digest(const Manifest& manifest) {
  Sha256 hash;
  for (const ManifestOutput& output : manifest.outputs) {
    hash.update(output.path + "\n" + hex(output.digest) + "\n");
  }
  return hash.finish();
}

std::string folder_name(const Digest& key) {
  return hex(key).substr(0, 16);
}

bool is_safe_output_path(std::string_view path) {
  constexpr std::size_t kLongestPath = 1024;
  constexpr std::size_t kLongestPart = 200;
  if (path.empty() || path.size() > kLongestPath) {
    return false;
  }
  while (true) {
    const std::size_t slash = path.find('/');
    const std::string_view part = path.substr(0, slash);
    if (part.empty() || part.size() > kLongestPart || part.front() == '.' || part.back() == '.') {
      return false;
    }
    if (!std::all_of(part.begin(), part.end(), [](char c) {
          return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                 c == '.' || c == '_' || c == '-';
        })) {
      return false;
    }
    if (slash == std::string_view::npos) {
      return true;
    }
    path.remove_prefix(slash + 1);
  }
}

std::string manifest_text(const Manifest& manifest) {
  nlohmann::json json = to_json(manifest);
  json[kSelf] = hex(sha256(json.dump()));
  return json.dump(1) + "\n";
}

Manifest parse_manifest(std::string_view text, const std::string& file, const Limits& limits) {
  nlohmann::json json = parse_json(text, file, limits);
  Manifest manifest;
  {
    ObjectReader reader(json, file, "");
    if (reader.text("schema") != kSchema) {
      reader.refuse("schema", "'" + reader.text("schema").substr(0, 80) + "'", kSchema);
    }
    if (reader.count("schema_version") > kSchemaVersion) {
      throw NewerManifestError(
          file, "schema_version", std::to_string(reader.count("schema_version")),
          std::to_string(kSchemaVersion) +
              "; a newer atelier wrote it: use that one, or another workspace");
    }
    const bool has_warnings = reader.count("schema_version") > 1;
    if (reader.count("schema_version") < 1) {
      reader.refuse("schema_version", "0", "1 to " + std::to_string(kSchemaVersion));
    }
    const Digest self = reader.digest(kSelf);
    json.erase(kSelf);
    if (sha256(json.dump()) != self) {
      reader.refuse(kSelf, "another digest than that of the content", "an unchanged manifest");
    }
    manifest.stage = reader.text("stage");
    const std::int64_t version = reader.count("stage_version");
    if (version > 1'000'000) {
      reader.refuse("stage_version", std::to_string(version), "at most 1000000");
    }
    manifest.stage_version = static_cast<int>(version);
    manifest.device = reader.text("device");
    manifest.key = reader.digest("key");
    manifest.options = read_options(reader, file);
    manifest.canonical_options = reader.text("canonical_options");
    manifest.inputs = read_inputs(reader, file);
    manifest.outputs = read_outputs(reader, file);
    manifest.consent = consent_of(reader, file);
    manifest.metrics = read_metrics(reader);
    if (has_warnings) {
      manifest.warnings = read_warnings(reader);
    }
    manifest.build = reader.text("build");
    manifest.started = reader.text("started");
    manifest.finished = reader.text("finished");
    manifest.work_seconds = reader.number("work_seconds");
    manifest.peak_memory_bytes = reader.count("peak_memory_bytes");
    reader.finish();
  }
  check_canonical_options(manifest, file);
  if (stage_key(manifest.stage, manifest.stage_version, manifest.device, manifest.canonical_options,
                manifest.inputs) != manifest.key) {
    throw DataError(file, "key", "another key than that of the stage, options and inputs named",
                    "a manifest that agrees with itself");
  }
  return manifest;
}

}  // namespace atelier
