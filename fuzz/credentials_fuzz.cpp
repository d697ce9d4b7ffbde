#include <string_view>

#include "fuzz/reader.h"
#include "pipeline/sealing/credentials_file.h"

ATELIER_FUZZ_READER(credentials) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto store = atelier::stored_credentials(text, "a file");
  if (!store) {
    throw atelier::DataError("a file", "content credentials", "none", "a file that has them");
  }
  const atelier::CredentialsFound found = atelier::read_credentials(*store, "a file");
  if (found.binding) {
    atelier::bound_content(text, *found.binding, "a file");
  }
  if (!found.problem.empty()) {
    throw atelier::DataError("a file", "content credentials", found.problem, "as they were signed");
  }
}
