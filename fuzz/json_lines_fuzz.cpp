#include "core/io/table_text.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(json_lines) {
  const atelier::JsonLines lines = atelier::parse_json_lines(atelier::as_text(bytes), "jsonl");
  ATELIER_CHECK(lines.lines >= 0 && lines.findings.size() <= 1, "one last line");
}
