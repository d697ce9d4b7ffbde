#include <string_view>

#include "fuzz/reader.h"
#include "pipeline/pictures/run_account.h"

/// What is read can be written, and read again to the same text.
ATELIER_FUZZ_READER(run_account) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string written =
      atelier::run_account_text(atelier::parse_run_account(text, "run.json"));
  ATELIER_CHECK(atelier::run_account_text(atelier::parse_run_account(written)) == written,
                "the account of a run does not round-trip");
}
