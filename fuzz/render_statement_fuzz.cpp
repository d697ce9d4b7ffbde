#include <string_view>

#include "fuzz/reader.h"
#include "pipeline/sealing/render_statement.h"

ATELIER_FUZZ_READER(render_statement) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string again =
      atelier::render_statement_text(atelier::parse_render_statement(text, "statement.json"));
  ATELIER_CHECK(atelier::render_statement_text(
                    atelier::parse_render_statement(again, "statement.json")) == again,
                "a statement that is another one once it is written");
}
