#include <algorithm>
#include <fstream>

#include "core/io/ground_truth_archive.h"
#include "tests/capture/seeded_defects.h"

namespace atelier::fixtures {
namespace {

std::filesystem::path file(const Spoiled& spoiled, const char* kind, const char* camera,
                           int frame) {
  return spoiled.folder / kind / camera / (frame_name(frame) + ".png");
}

/// Every value of an image, times a factor for each channel.
void tint(ByteImage& image, double red, double green, double blue) {
  const double factors[] = {red, green, blue};
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] =
        static_cast<std::uint8_t>(std::clamp(image.data[i] * factors[i % 3], 0.0, 255.0));
  }
}

void blur(ByteImage& image) {
  for (int pass = 0; pass < 12; ++pass) {
    const ByteImage before = image;
    for (int y = 1; y + 1 < image.height; ++y) {
      for (int x = 1; x + 1 < image.width; ++x) {
        for (int c = 0; c < 3; ++c) {
          image.at(x, y, c) = static_cast<std::uint8_t>(
              (2 * before.at(x, y, c) + before.at(x - 1, y, c) + before.at(x + 1, y, c) +
               before.at(x, y - 1, c) + before.at(x, y + 1, c)) /
              6);
        }
      }
    }
  }
}

void invert_mask(ByteImage& mask) {
  for (std::uint8_t& value : mask.data) {
    value = static_cast<std::uint8_t>(255 - value);
  }
}

/// The numbers of the label images, renamed.
void renumber(Spoiled& spoiled, const std::array<std::uint8_t, 20>& numbers) {
  for (auto& frames : spoiled.capture.labels) {
    for (ByteImage& labels : frames) {
      for (std::uint8_t& value : labels.data) {
        value = numbers[value];
      }
    }
  }
}

}  // namespace

std::vector<SeededDefect> picture_defects() {
  return {
      {"a frame missing in one camera", "frame-missing", "cam0 frame 5", "", 0, nullptr,
       [](Spoiled& s) { std::filesystem::remove(file(s, "images", "cam0", 5)); }},
      {"the last four frames missing in one camera", "frame-missing", "cam3 frame 12", "", 1,
       nullptr,
       [](Spoiled& s) {
         for (int frame = 12; frame <= 15; ++frame) {
           std::filesystem::remove(file(s, "images", "cam3", frame));
         }
       }},
      {"every second frame missing in one camera", "frame-missing", "cam2 frame 2", "", 0, nullptr,
       [](Spoiled& s) {
         for (int frame = 2; frame <= 15; frame += 2) {
           std::filesystem::remove(file(s, "images", "cam2", frame));
         }
       }},
      {"a camera without images", "camera-without-pictures", "cam4", "--capture.leave-out cam4", 1,
       nullptr, [](Spoiled& s) { std::filesystem::remove_all(s.folder / "images" / "cam4"); }},
      {"an image cut off", "image-damaged", "cam1 frame 7", "", 0, nullptr,
       [](Spoiled& s) { std::filesystem::resize_file(file(s, "images", "cam1", 7), 700); }},
      {"an empty image file", "image-damaged", "cam5 frame 3", "", 1, nullptr,
       [](Spoiled& s) { std::filesystem::resize_file(file(s, "images", "cam5", 3), 0); }},
      {"text in place of an image", "image-damaged", "cam6 frame 9", "", 0, nullptr,
       [](Spoiled& s) { std::ofstream(file(s, "images", "cam6", 9)) << "<html>404</html>"; }},
      {"a black image", "image-black", "cam2 frame 4", "", 1,
       [](Spoiled& s) { tint(s.capture.pictures[2][3], 0, 0, 0); }},
      {"a saturated image", "image-saturated", "cam3 frame 8", "", 0,
       [](Spoiled& s) { tint(s.capture.pictures[3][7], 5, 5, 5); }},
      {"a blurred image", "image-blurred", "cam4 frame 10", "", 1,
       [](Spoiled& s) { blur(s.capture.pictures[4][9]); }},
      {"an exposure jump", "exposure-jump", "cam5 frame 6", "", 0,
       [](Spoiled& s) {
         for (std::size_t f = 5; f < 15; ++f) {
           tint(s.capture.pictures[5][f], 1.5, 1.5, 1.5);
         }
       }},
      {"a frame recorded twice", "frame-duplicate", "cam1 frame 9", "", 1,
       [](Spoiled& s) { s.capture.pictures[1][8] = s.capture.pictures[1][7]; }},
      {"an image of another size", "frame-size", "cam0 frame 2", "", 0,
       [](Spoiled& s) { s.capture.pictures[0][1] = ByteImage(40, 50, 3, 90); }},
      {"one camera's images copied to another", "picture-twins", "cam5", "", 1,
       [](Spoiled& s) { s.capture.pictures[5] = s.capture.pictures[2]; }},
      {"white balance of one camera off", "camera-colour", "cam2", "", 0,
       [](Spoiled& s) {
         for (ByteImage& image : s.capture.pictures[2]) {
           tint(image, 1.2, 1, 0.75);
         }
       }},
      {"exposure of one camera half the others'", "camera-exposure", "cam4", "", 1,
       [](Spoiled& s) {
         for (ByteImage& image : s.capture.pictures[4]) {
           tint(image, 0.6, 0.6, 0.6);
         }
       }},
      {"masks of one camera inverted", "mask-inverted", "cam3", "--capture.masks cam3=inverted", 0,
       [](Spoiled& s) {
         std::for_each(s.capture.masks[3].begin(), s.capture.masks[3].end(), invert_mask);
       }},
      {"masks of every camera inverted", "mask-inverted", "all 6 cameras",
       "--capture.masks all=inverted", 1,
       [](Spoiled& s) {
         for (auto& frames : s.capture.masks) {
           std::for_each(frames.begin(), frames.end(), invert_mask);
         }
       }},
      {"an empty mask", "mask-empty", "cam2 frame 8", "", 0,
       [](Spoiled& s) {
         std::fill(s.capture.masks[2][7].data.begin(), s.capture.masks[2][7].data.end(), 0);
       }},
      {"a mask set everywhere", "mask-full", "cam0 frame 3", "", 1,
       [](Spoiled& s) {
         std::fill(s.capture.masks[0][2].data.begin(), s.capture.masks[0][2].data.end(), 255);
       }},
      {"a mask of another size", "mask-size", "cam6 frame 5", "", 0,
       [](Spoiled& s) {
         ByteImage mask(36, 40, 1);
         for (int y = 10; y < 30; ++y) {
           mask.at(18, y) = 255;
         }
         s.capture.masks[6][4] = mask;
       }},
      {"a mask file cut off", "mask-damaged", "cam1 frame 1", "", 1, nullptr,
       [](Spoiled& s) { std::filesystem::resize_file(file(s, "masks", "cam1", 1), 60); }},
      {"masks that are somewhere else", "mask-disagrees", "cam5", "", 0,
       [](Spoiled& s) {
         for (ByteImage& mask : s.capture.masks[5]) {
           // The person without the lower two thirds.
           int top = mask.height;
           for (int y = 0; y < mask.height; ++y) {
             for (int x = 0; x < mask.width; ++x) {
               top = mask.at(x, y) != 0 ? std::min(top, y) : top;
             }
           }
           for (int y = top + mask.height / 6; y < mask.height; ++y) {
             for (int x = 0; x < mask.width; ++x) {
               mask.at(x, y) = 0;
             }
           }
         }
       }},
      {"masks of one camera upside down", "mask-turned", "cam4", "", 0,
       [](Spoiled& s) {
         std::for_each(s.capture.masks[4].begin(), s.capture.masks[4].end(), turn_upside_down);
       }},
      {"images of one camera turned by 180 degrees, with masks and detections", "camera-turned",
       "cam3", "--capture.turned cam3=180", 0,
       [](Spoiled& s) {
         for (auto* kind : {&s.capture.pictures, &s.capture.masks, &s.capture.labels}) {
           std::for_each((*kind)[3].begin(), (*kind)[3].end(), turn_upside_down);
         }
         for (Keypoints2d& rows : s.capture.keypoints[3]) {
           turn_rows_upside_down(rows, s.capture.cameras[3]);
         }
       }},
      {"numbers of labels that the taxonomy does not have", "label-unknown", "cam3 frame 2", "", 1,
       [](Spoiled& s) { s.capture.labels[3][1].at(40, 40) = 77; }},
      {"a label file cut off", "labels-damaged", "cam0 frame 6", "", 0, nullptr,
       [](Spoiled& s) { std::filesystem::resize_file(file(s, "labels", "cam0", 6), 60); }},
      {"CIHP read as LIP: skin of the torso is called a jumpsuit", "label-taxonomy", "",
       "--capture.label-taxonomy cihp", 1,
       [](Spoiled& s) {
         // The arms' skin under CIHP's number for skin of the torso.
         renumber(s, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 10, 15, 16, 17, 18, 19});
       }},
      {"LIP read as CIHP: a jumpsuit is called skin", "label-taxonomy", "",
       "--capture.label-taxonomy lip", 0,
       [](Spoiled& s) {
         renumber(s, {0, 1, 2, 3, 4, 10, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19});
         s.capture.info.label_taxonomy = "cihp";
       }},
      {"ATR read as LIP", "label-taxonomy", "", "--capture.label-taxonomy atr", 0,
       [](Spoiled& s) {
         // LIP's numbers as ATR has them: hair 2, upper 4, trousers 6, face 11, arms 14, shoes 9.
         renumber(s, {0, 1, 2, 0, 3, 4, 7, 4, 9, 6, 7, 17, 5, 11, 14, 15, 12, 13, 9, 10});
       }},
      {"no consent recorded", "consent-none", "", "", 0,
       [](Spoiled& s) { s.capture.info.consent.clear(); }},
      {"consent that is over", "consent-ended", "", "", 1,
       [](Spoiled& s) { s.capture.info.consent.front().until = "2020-01-31"; }},
  };
}

}  // namespace atelier::fixtures
