#include "appearance/appearance_data.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// What is read agrees with itself, can be written and reads the same.
ATELIER_FUZZ_READER(appearance_data) {
  const atelier::AppearanceData data =
      atelier::appearance_data_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                         "atelier.appearance_data", 2, "data"),
                                  "data");
  atelier::check_appearance_data(data);
  const atelier::AppearanceData again =
      atelier::appearance_data_of(atelier::archive_of(data), "written");
  ATELIER_CHECK(again.frames.size() == data.frames.size() &&
                    atelier::equal_arrays(again.frames[0].position, data.frames[0].position) &&
                    again.views.size() == data.views.size() &&
                    again.camera_ids == data.camera_ids &&
                    atelier::equal_arrays(again.uvs, data.uvs),
                "data read back as they were");
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    ATELIER_CHECK(again.views[i].pixel == data.views[i].pixel &&
                      again.views[i].u == data.views[i].u && again.views[i].v == data.views[i].v &&
                      again.views[i].colors == data.views[i].colors,
                  "views read back as they were");
  }
}
