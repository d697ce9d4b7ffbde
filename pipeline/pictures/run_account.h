#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// Outcome of one stage in a run of the chain.
struct RunStageAccount {
  std::string stage;
  std::string end;      ///< "done", "done already", "skipped", "failed" or "not asked for"
  std::string why;      ///< of what was skipped or failed, one sentence
  double expected = 0;  ///< s
  /// s that it took in this run; of what was done already, in the run that made it (0: not known)
  double seconds = 0;
};

/// The account that a run leaves in its workspace, report/run.json, for the report.
struct RunAccount {
  std::string capture;
  std::string started;        ///< "2026-11-21T10:40:00Z"
  double seconds = 0;         ///< of its stages; the report, in which they stand, comes behind them
  double report_seconds = 0;  ///< of the report; 0: not known
  std::vector<RunStageAccount> stages;
};

/// Takes over from the account of an earlier run how long those stages took then that were done
/// already or not asked for in this one.
void keep_times(const RunAccount& earlier, RunAccount& account);

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
