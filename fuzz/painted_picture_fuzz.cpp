#include "appearance/painted_picture.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// An image of 5 x 3 pixels; what is read can be written and reads the same.
ATELIER_FUZZ_READER(painted_picture) {
  const atelier::Image picture =
      atelier::painted_picture_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                         "atelier.painted_picture", 1, "picture"),
                                  5, 3, "picture");
  const atelier::Image again =
      atelier::painted_picture_of(atelier::archive_of_painted(picture), 5, 3, "written");
  ATELIER_CHECK(again.data == picture.data, "an image reads back as it was");
}
