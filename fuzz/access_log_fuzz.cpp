#include <string_view>

#include "fuzz/reader.h"
#include "pipeline/sealing/access_log.h"

ATELIER_FUZZ_READER(access_log) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::string again;
  atelier::Digest head{};
  for (const atelier::AccessEntry& entry : atelier::parse_access_log(text, "access.log").entries) {
    const std::string line = atelier::access_line(entry, head);
    head = *atelier::digest_from_hex(std::string_view(line).substr(line.size() - 65, 64));
    again += line;
  }
  ATELIER_CHECK(again == text, "a log that is another one once it is written");
}
