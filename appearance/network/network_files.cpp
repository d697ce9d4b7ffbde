#include "appearance/network/network_files.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <system_error>

#include "appearance/network/train.h"
#include "appearance/training_log.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/safetensors.h"
#include "core/renamed_options.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The content of a file; nothing where there is none.
std::string text_at(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// Whether a stage keeps this checkpoint among the work that it has not finished, of which no user
/// knows: <workspace>/<stage>/.staging-<key>/...
bool is_of_stage(const fs::path& checkpoint) {
  return std::any_of(checkpoint.begin(), checkpoint.end(),
                     [](const fs::path& part) { return part.string().starts_with(".staging-"); });
}

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code unknown;  // of what is not there, or may not be looked at
  const fs::path real = fs::weakly_canonical(a, unknown);
  return fs::equivalent(a, b, unknown) ||
         (!real.empty() && real == fs::weakly_canonical(b, unknown));
}

}  // namespace

bool begins_as_tensors(const fs::path& path) {
  std::array<char, 9> begin{};
  return std::ifstream(path, std::ios::binary).read(begin.data(), begin.size()) &&
         begin.back() == '{';
}

Training checkpoint_at(const fs::path& path, const AppearanceData& data,
                       const TrainOptions& options) {
  constexpr const char* kAnother =
      "a checkpoint, or no file yet; name another --checkpoint, or give --force to the stage that "
      "trains it";
  if (!begins_as_tensors(path)) {
    throw DataError(path.string(), "", "no checkpoint of a training", kAnother);
  }
  try {
    const Safetensors found = read_safetensors(path);
    if (!found.metadata.contains("training")) {
      const auto schema = found.metadata.find("schema");
      const bool network = schema != found.metadata.end() && schema->second == kModelSchema;
      throw DataError(path.string(), "",
                      network ? "a finished network, which does not say how to go on"
                              : "tensors that are no checkpoint of a training",
                      kAnother);
    }
    Training training = training_of(found.tensors, found.metadata, path.string());
    require_same_training(training, data, options, path.string());
    return training;
  } catch (const DataError& error) {
    if (error.expected == kAnother) {
      throw;
    }
    throw DataError(error.file, error.where, error.found,
                    is_of_stage(path)
                        ? "a sound checkpoint; give --force to train from the beginning"
                        : error.expected +
                              "; to train from the beginning remove that file, or "
                              "give --force to the stage that trains it");
  }
}

AppearanceModel network_at(const fs::path& path) {
  try {
    const Safetensors found = read_safetensors(path);
    return appearance_model_of(found.tensors, found.metadata, path.string());
  } catch (const DataError& error) {
    if (error.expected.find(" again") != std::string::npos) {
      throw;
    }
    const std::string folder = path.parent_path().parent_path().parent_path().filename().string();
    const bool on_truth = folder == "oracle" || renamed_stage(folder) == "oracle";
    const char* stage = folder == "avatar" ? "avatar" : on_truth ? "oracle" : "appearance";
    throw DataError(error.file, error.where, error.found,
                    error.expected + "; run 'atelier " + stage + "' again");
  }
}

void require_different(const std::vector<NamedFile>& places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!places[i].path.empty() && !places[j].path.empty() &&
          is_same_file(places[i].path, places[j].path)) {
        throw UsageError(places[j].name + " and " + places[i].name +
                         " are one file: " + places[i].path.string());
      }
    }
  }
}

void require_result_place(const fs::path& path) {
  if (path.empty()) {
    return;
  }
  const fs::file_type kind = link_kind(path);
  if (kind != fs::file_type::not_found && kind != fs::file_type::regular) {
    throw DataError(path.string(), "", "a link, device or folder",
                    "a regular file, or none yet, to write to");
  }
  require_file_place(path);
}

bool file_begins_with(const fs::path& path, std::string_view begin) {
  std::string found(begin.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(found.data(), static_cast<std::streamsize>(found.size()));
  return found == begin;
}

void require_own_file(const fs::path& path, bool own, const char* kind) {
  if (fs::exists(path) && !own) {
    throw DataError(path.string(), "", std::string("no ") + kind + ", and it would be replaced",
                    std::string("such a file, or none yet"));
  }
}

std::string log_at(const fs::path& path) {
  std::string text = path.empty() ? "" : text_at(path);
  if (!text.empty() && !text.starts_with(training_log_header())) {
    throw DataError(path.string(), "first line", "no log of a training, and it would be replaced",
                    "such a log, or no file");
  }
  return text;
}

}  // namespace atelier
