#include "core/store/frame_log.h"

#include <cerrno>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include <fcntl.h>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/system_reason.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::string_view kPrefix = ".frames-";
constexpr std::string_view kSuffix = ".jsonl";

[[noreturn]] void fail(const std::filesystem::path& path, const char* action) {
  const int error = errno;
  throw EnvironmentError(path.string(), std::string(action) + ": " + system_reason(error));
}

/// Nothing if they are not what `append` writes.
std::optional<std::vector<std::string>> warnings_of(const nlohmann::json& record) {
  std::vector<std::string> warnings;
  const auto found = record.find("warnings");
  if (found == record.end()) {
    return warnings;  // a log of before there were any
  }
  if (!found->is_array()) {
    return std::nullopt;
  }
  for (const nlohmann::json& item : *found) {
    if (!item.is_string() || !is_printable_utf8(item.get<std::string>())) {
      return std::nullopt;
    }
    warnings.push_back(item.get<std::string>());
  }
  return warnings;
}

nlohmann::json json_of(const ManifestOutput& output) {
  return {{"path", output.path}, {"size", output.size}, {"sha256", hex(output.digest)}};
}

/// Nothing if it is not what `json_of` makes.
std::optional<ManifestOutput> output_of(const nlohmann::json& json) {
  if (!json.is_object()) {
    return std::nullopt;
  }
  const auto path = json.find("path");
  const auto size = json.find("size");
  const auto digits = json.find("sha256");
  if (path == json.end() || !path->is_string() || size == json.end() ||
      !size->is_number_unsigned() || digits == json.end() || !digits->is_string()) {
    return std::nullopt;
  }
  const auto digest = digest_from_hex(digits->get<std::string>());
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (!digest || !is_safe_output_path(path->get<std::string>()) ||
      size->get<std::uint64_t>() > kMost) {
    return std::nullopt;
  }
  return ManifestOutput{path->get<std::string>(), size->get<std::int64_t>(), *digest};
}

/// The further files of a frame; nothing if they are not what `append` writes.
std::optional<std::vector<ManifestOutput>> beside_of(const nlohmann::json& record) {
  std::vector<ManifestOutput> beside;
  const auto found = record.find("beside");
  if (found == record.end()) {
    return beside;
  }
  if (!found->is_array()) {
    return std::nullopt;
  }
  for (const nlohmann::json& item : *found) {
    const std::optional<ManifestOutput> output = output_of(item);
    if (!output) {
      return std::nullopt;
    }
    beside.push_back(*output);
  }
  return beside;
}

}  // namespace

FrameLog::FrameLog(const std::filesystem::path& staging) {
  std::string pattern =
      (staging / (std::string(kPrefix) + "XXXXXX" + std::string(kSuffix))).string();
  file_ = mkostemps(pattern.data(), static_cast<int>(kSuffix.size()), O_CLOEXEC);
  if (file_ < 0) {
    fail(staging, "cannot create a file in it");
  }
  path_ = pattern;
  sync_directory(staging);
}

FrameLog::~FrameLog() {
  close(file_);
}

void FrameLog::append(const FrameRecord& record) {
  nlohmann::json json = json_of(record.output);
  json["frame"] = record.frame_id;
  json["seconds"] = record.seconds;
  json["peak"] = record.peak_memory_bytes;
  json["warnings"] = record.warnings;
  if (record.left_out) {
    json["left_out"] = true;
  }
  for (const ManifestOutput& output : record.beside) {
    json["beside"].push_back(json_of(output));
  }
  const std::string line = json.dump() + "\n";
  std::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t written = write(file_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written < 0) {
      fail(path_, "cannot write");
    }
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  if (fsync(file_) != 0) {
    fail(path_, "cannot sync");
  }
}

void add_frame_records(std::string_view text, std::map<int, FrameRecord>& records) {
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) {
      break;  // torn
    }
    // Our own file, yet a disk may have spoiled it: what does not read is work to be done again.
    const nlohmann::json json =
        nlohmann::json::parse(text.begin() + static_cast<long>(begin),
                              text.begin() + static_cast<long>(end), nullptr, false);
    begin = end + 1;
    const std::optional<ManifestOutput> output = output_of(json);
    if (!output) {
      continue;
    }
    const auto frame = json.find("frame");
    const auto seconds = json.find("seconds");
    const auto peak = json.find("peak");
    if (frame == json.end() || !frame->is_number_unsigned() || seconds == json.end() ||
        !seconds->is_number() || peak == json.end() || !peak->is_number_unsigned()) {
      continue;
    }
    const std::optional<std::vector<std::string>> warnings = warnings_of(json);
    const std::optional<std::vector<ManifestOutput>> beside = beside_of(json);
    constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    const auto left_out = json.find("left_out");
    const bool known = left_out == json.end() || *left_out == true;
    if (!warnings || !beside || !known || frame->get<std::uint64_t>() > 2'000'000'000u ||
        peak->get<std::uint64_t>() > kMost || !(seconds->get<double>() >= 0)) {
      continue;
    }
    const int frame_id = frame->get<int>();
    records[frame_id] = {.frame_id = frame_id,
                         .output = *output,
                         .beside = *beside,
                         .seconds = seconds->get<double>(),
                         .peak_memory_bytes = peak->get<std::int64_t>(),
                         .warnings = *warnings,
                         .left_out = left_out != json.end()};
  }
}

std::map<int, FrameRecord> read_frame_logs(const std::filesystem::path& staging) {
  std::map<int, FrameRecord> records;
  for (const std::filesystem::path& entry : list_folder(staging)) {
    if (!is_frame_log_name(entry.filename().string()) ||
        link_kind(entry) != std::filesystem::file_type::regular) {
      continue;
    }
    add_frame_records(read_file_text(entry, Limits{}.text_file_bytes * 16), records);
  }
  return records;
}

bool is_frame_log_name(std::string_view name) {
  return name.size() == kPrefix.size() + 6 + kSuffix.size() && name.starts_with(kPrefix) &&
         name.ends_with(kSuffix);
}

}  // namespace atelier
