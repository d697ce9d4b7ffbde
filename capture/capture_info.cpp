#include "capture/capture_info.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json_place.h"
#include "core/io/toml.h"
#include "core/quantity_text.h"
#include "core/store/consent_file.h"
#include "core/utf8.h"

namespace atelier {
namespace {

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump();  // JSON's escapes are TOML's
}

template <class T>
std::string listed(const std::vector<T>& values) {
  return nlohmann::json(values).dump();
}

std::vector<std::string> texts_of(const JsonPlace& place) {
  std::vector<std::string> texts;
  for (const JsonPlace& item : place.items()) {
    texts.push_back(item.text());
  }
  return texts;
}

std::vector<int> ids_of(const JsonPlace& place, const Limits& limits) {
  std::vector<int> ids;
  if (static_cast<std::int64_t>(place.size()) > limits.frames) {
    place.fail(std::to_string(place.size()) + " frames",
               "at most " + std::to_string(limits.frames));
  }
  for (const JsonPlace& item : place.items()) {
    ids.push_back(static_cast<int>(item.integer(0, 999'999'999)));
  }
  return ids;
}

void refuse_unknown_keys(const JsonPlace& table, const std::set<std::string>& known) {
  for (const auto& [key, value] : table.value().items()) {
    if (!known.contains(key)) {
      table.fail("the key '" + key + "'", "only keys that docs/reference/formats.md names");
    }
  }
}

}  // namespace

void check_capture_info(const CaptureInfo& info, const std::string& file) {
  const auto refuse = [&](const std::string& where, const std::string& found,
                          const std::string& expected) {
    throw DataError(file, where, found, expected);
  };
  if (!is_printable_utf8(info.subject)) {
    refuse("subject", "no printable text", "a name or pseudonym");
  }
  for (const std::string& name : {info.keypoint_schema, info.label_taxonomy}) {
    if (!is_plain_name(name)) {
      refuse("keypoint_schema, label_taxonomy", "'" + name + "'",
             "names of docs/reference/formats.md");
    }
  }
  for (const Consent& consent : info.consent) {
    if (consent.who.empty() || consent.scope.empty() ||
        !is_printable_utf8(consent.who + consent.scope + consent.until + consent.revocation)) {
      refuse("consent", "no who or no scope, or no printable text", "whose consent, and for what");
    }
  }
  if (info.sequences.empty()) {
    refuse("sequence", "none", "at least one [[sequence]]");
  }
  std::vector<int> frames;  // increasing
  std::set<std::string> names;
  for (const CaptureSequence& sequence : info.sequences) {
    const std::string where = "sequence '" + sequence.name + "'";
    if (!is_plain_name(sequence.name) || !names.insert(sequence.name).second) {
      refuse(where, "its name", "letters, digits, '.', '_' and '-', each name once");
    }
    if (sequence.kind != "minimal" && sequence.kind != "clothed") {
      refuse(where, "kind '" + sequence.kind + "'", "minimal or clothed");
    }
    if (!(sequence.fps > 0) || !std::isfinite(sequence.fps)) {
      refuse(where, "fps " + short_number(sequence.fps), "a number above 0");
    }
    if (sequence.frame_ids.empty()) {
      refuse(where, "no frames", "at least one frame id");
    }
    for (std::size_t i = 0; i < sequence.frame_ids.size(); ++i) {
      const int id = sequence.frame_ids[i];
      if (id < 0 || (i > 0 && id <= sequence.frame_ids[i - 1]) ||
          std::binary_search(frames.begin(), frames.end(), id)) {
        refuse(where, "frame id " + std::to_string(id),
               "ids from 0 that increase and are in one sequence");
      }
    }
    const auto old =
        frames.insert(frames.end(), sequence.frame_ids.begin(), sequence.frame_ids.end());
    std::inplace_merge(frames.begin(), old, frames.end());
  }
  for (const std::string& camera : info.held_out_cameras) {
    if (!is_plain_name(camera)) {
      refuse("held_out_cameras", "'" + camera + "'", "names of cameras");
    }
  }
  for (const int id : info.held_out_frames) {
    if (!std::binary_search(frames.begin(), frames.end(), id)) {
      refuse("held_out_frames", std::to_string(id), "frames of the sequences");
    }
  }
  if (info.image_format != "png" && info.image_format != "jpg") {
    refuse("image_format", "'" + info.image_format + "'", "png or jpg");
  }
}

std::string capture_toml(const CaptureInfo& info) {
  check_capture_info(info);
  std::ostringstream out;
  out.exceptions(std::ios::badbit);  // or it would swallow that memory runs out
  out << "schema = \"atelier-capture\"\nversion = 1\nunits = \"m\"\nup_axis = \"y\"\n"
      << "subject = " << quoted(info.subject) << "\nsynthetic = " << std::boolalpha
      << info.synthetic << "\nimage_format = " << quoted(info.image_format)
      << "\nkeypoint_schema = " << quoted(info.keypoint_schema)
      << "\nlabel_taxonomy = " << quoted(info.label_taxonomy)
      << "\nheld_out_cameras = " << listed(info.held_out_cameras)
      << "\nheld_out_frames = " << listed(info.held_out_frames) << "\n";
  for (const CaptureSequence& sequence : info.sequences) {
    out << "\n[[sequence]]\nname = " << quoted(sequence.name)
        << "\nkind = " << quoted(sequence.kind) << "\nfps = " << nlohmann::json(sequence.fps).dump()
        << "\nframe_ids = " << listed(sequence.frame_ids) << "\n";
  }
  out << (info.consent.empty() ? "" : "\n") << consent_toml(info.consent);
  return out.str();
}

CaptureInfo parse_capture_toml(const std::string& text, const std::string& file,
                               const Limits& limits) {
  const nlohmann::json parsed = parse_toml(text, file, limits);
  const JsonPlace root(parsed, file);
  refuse_unknown_keys(root, {"schema", "version", "units", "up_axis", "subject", "synthetic",
                             "image_format", "keypoint_schema", "label_taxonomy",
                             "held_out_cameras", "held_out_frames", "sequence", "consent"});
  const auto must_be = [&](const char* key, const std::string& expected) {
    const JsonPlace place = root.at(key);
    if (place.text() != expected) {
      place.fail("'" + place.text() + "'", expected);
    }
  };
  must_be("schema", "atelier-capture");
  root.at("version").integer(1, 1);
  must_be("units", "m");
  must_be("up_axis", "y");
  CaptureInfo info;
  info.subject = root.text_or("subject", "");
  info.synthetic = root.boolean_or("synthetic", false);
  info.image_format = root.text_or("image_format", "png");
  info.keypoint_schema = root.text_or("keypoint_schema", "body_25");
  info.label_taxonomy = root.text_or("label_taxonomy", "atelier");
  if (const auto cameras = root.find("held_out_cameras")) {
    info.held_out_cameras = texts_of(*cameras);
  }
  if (const auto frames = root.find("held_out_frames")) {
    info.held_out_frames = ids_of(*frames, limits);
  }
  for (const JsonPlace& table : root.items("sequence")) {
    refuse_unknown_keys(table, {"name", "kind", "fps", "frame_ids"});
    info.sequences.push_back({table.at("name").text(), table.at("kind").text(),
                              table.at("fps").number(), ids_of(table.at("frame_ids"), limits)});
  }
  info.consent = parse_consent(text, file);
  check_capture_info(info, file);
  return info;
}

CaptureInfo read_capture_info(const std::filesystem::path& folder, const Limits& limits) {
  const std::filesystem::path path = folder / "capture.toml";
  if (!std::filesystem::exists(path)) {
    throw DataError(path.string(), "", "there is no such file",
                    "a finished native capture (an interrupted one has no capture.toml: run the "
                    "same command again)");
  }
  return parse_capture_toml(read_file_text(path, limits.text_file_bytes), path.string(), limits);
}

}  // namespace atelier
