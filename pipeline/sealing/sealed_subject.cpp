#include "pipeline/sealing/sealed_subject.h"

#include <algorithm>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/store/consent_file.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Whether there is something that may be looked at: a capture may have been somebody else's.
bool can_be_seen(const fs::path& path) {
  try {
    return file_kind(path) != fs::file_type::not_found;
  } catch (const EnvironmentError&) {
    return false;
  }
}

bool is_workspace(const fs::path& folder, std::span<const Stage> stages) {
  return std::any_of(stages.begin(), stages.end(), [&](const Stage& stage) {
    return link_kind(folder / stage.name / "current") == fs::file_type::symlink;
  });
}

std::vector<Consent> consent_of_workspace(const fs::path& folder, std::span<const Stage> stages) {
  std::vector<Consent> all;
  for (const StageStatus& status : workspace_status(stages, folder)) {
    if (status.state == StageStatus::State::Damaged || status.state == StageStatus::State::Newer) {
      throw DataError(folder.string(), status.stage,
                      std::string("a result that is ") + state_name(status.state),
                      "a sound one; atelier status says what is wrong");
    }
    add_consent(all, consent_of(status));
  }
  return all;
}

}  // namespace

std::vector<Consent> consent_of(const StageStatus& status) {
  std::vector<Consent> all;
  if (!status.manifest) {
    return all;
  }
  add_consent(all, status.manifest->consent);
  for (const ManifestInput& input : status.manifest->inputs) {
    if (input.stage.empty() && can_be_seen(input.path)) {
      add_consent(all, read_consent(input.path));
    }
  }
  return all;
}

void require_sound_files(const fs::path& folder, std::span<const Stage> stages) {
  for (const Stage& stage : stages) {
    const auto current = current_name(folder / stage.name);
    if (!current) {
      continue;
    }
    const fs::path result = folder / stage.name / *current;
    for (const Finding& finding :
         check_outputs(result, read_manifest(result, std::string(stage.name)), Check::Digests)) {
      if (finding.severity == Severity::Error) {
        throw DataError(finding.place, "", finding.what,
                        "a sound result; atelier " + std::string(stage.name) +
                            " INPUT WORKSPACE, with the same arguments recomputes it");
      }
    }
  }
}

SealingNote sealed_subject(const fs::path& folder, std::span<const Stage> stages) {
  SealingNote note;
  if (file_kind(folder) != fs::file_type::directory) {
    return note;
  }
  if (is_workspace(folder, stages)) {
    note.kind = "workspace";
    note.consent = consent_of_workspace(folder, stages);
    return note;
  }
  for (const fs::path& path : list_folder(folder)) {
    if (file_kind(path) != fs::file_type::directory) {
      continue;
    }
    if (file_kind(path / "consent.txt") == fs::file_type::regular) {
      note.kind = "export";
    }
    if (file_kind(path / kConsentFile) == fs::file_type::regular) {
      add_consent(note.consent, read_consent(path));
    }
  }
  return note;
}

}  // namespace atelier
