#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// What became of one stage in a run of the chain.
struct RunStageAccount {
  std::string stage;
  std::string end;      ///< "done", "done already", "skipped", "failed" or "not asked for"
  std::string why;      ///< of what was skipped or failed, one sentence
  double expected = 0;  ///< s
  double seconds = 0;   ///< s that it took in this run
};

/// The account that a run leaves in its workspace, report/run.json, for the report.
struct RunAccount {
  std::string capture;
  std::string started;  ///< "2026-11-21T10:40:00Z"
  double seconds = 0;
  std::vector<RunStageAccount> stages;
};

/// The text of run.json (schema "atelier.run", version 1), and back. Throws DataError for a text
/// that is none: other fields or ends than these, seconds below 0.
std::string run_account_text(const RunAccount& account);
RunAccount parse_run_account(std::string_view text, const std::string& file = "");

/// Writes it. Throws EnvironmentError.
void write_run_account(const std::filesystem::path& workspace, const RunAccount& account);

/// The account of the workspace's last run; nothing where there was none. Throws DataError for a
/// file that is none.
std::optional<RunAccount> read_run_account(const std::filesystem::path& workspace);

}  // namespace atelier
