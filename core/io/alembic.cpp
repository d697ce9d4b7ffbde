#include "core/io/alembic.h"

#include "core/error.h"
#include "core/io/lower_extension.h"

namespace atelier {

void refuse_alembic(const std::filesystem::path& path) {
  if (lower_extension(path) == ".abc") {
    throw DataError(path.string(), "", "Alembic, which is not read",
                    "binary USD (.usdc), or a folder of OBJ or PLY, one file a frame: Blender, "
                    "Houdini and Maya import Alembic and export these");
  }
}

}  // namespace atelier
