#include "core/io/table_text.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(csv) {
  const atelier::CsvTable table = atelier::parse_csv(atelier::as_text(bytes), "csv");
  ATELIER_CHECK(!table.columns.empty() && table.rows >= 0, "a table without columns");
}
