#include "core/store/derived_folder.h"

#include <algorithm>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/store/commit.h"
#include "core/store/consent_file.h"
#include "core/store/input_digest.h"
#include "core/store/made_of.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Which results, by the keys that their folders are named after, and what their people agreed to.
struct MadeOf {
  std::string text = "4\n";  // the version of this file: what it makes of the same results
  std::vector<Consent> consent;
};

MadeOf made_of(const std::vector<fs::path>& results) {
  MadeOf all;
  for (const fs::path& result : results) {
    const std::string stage = result.parent_path().filename().string();
    all.text += stage + " " + result.filename().string() + "\n";
    const Manifest manifest = read_manifest(result, stage);
    for (const Finding& finding : check_outputs(result, manifest, Check::Digests)) {
      if (finding.severity == Severity::Error) {
        throw DataError(finding.place, "", finding.what,
                        "a sound result; run 'atelier " + stage + "' again");
      }
    }
    add_consent(all.consent, manifest.consent);
  }
  all.text += consent_toml(all.consent);
  return all;
}

/// Every file below a folder but the note itself, with its digest, a line each.
std::string contents_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_directory() && entry.path() != folder / kMadeOfFile) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::string text;
  for (const fs::path& file : files) {
    text += file.lexically_relative(folder).generic_string() + " " +
            hex(digest_of_file(file).digest) + "\n";
  }
  return text;
}

/// Whether the folder is what was made of these results, byte for byte: nobody else looks whether
/// it is damaged, since it is the INPUT of the stage that reads it.
bool is_current(const fs::path& folder, const MadeOf& from) {
  const fs::path note = folder / kMadeOfFile;
  return fs::exists(note) &&
         read_file_text(note, Limits{}.text_file_bytes) == from.text + contents_of(folder);
}

}  // namespace

fs::path required_result(const fs::path& workspace, const std::string& stage) {
  const auto name = current_name(workspace / stage);
  if (!name) {
    throw DataError((workspace / stage).string(), "", "no result", "run 'atelier " + stage + "'");
  }
  return workspace / stage / *name;
}

fs::path derived_folder(const fs::path& workspace, const std::string& name,
                        const std::vector<fs::path>& results,
                        const std::function<void(const fs::path&)>& fill) {
  const MadeOf from = made_of(results);
  fs::path folder = workspace / name;
  if (is_current(folder, from)) {
    return folder;
  }
  const fs::path fresh = workspace / ("." + name + "-new");
  remove_folder(fresh);
  make_private_directory(fresh);
  fill(fresh);
  if (!from.consent.empty()) {
    write_file_atomically(fresh / kConsentFile, consent_toml(from.consent));
  }
  write_file_atomically(fresh / kMadeOfFile, from.text + contents_of(fresh));
  sync_directory(fresh);
  remove_folder(folder);
  fs::rename(fresh, folder);
  sync_directory(workspace);
  return folder;
}

}  // namespace atelier
