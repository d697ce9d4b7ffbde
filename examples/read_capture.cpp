// Opens a capture of any layout and prints its cameras and the mean colour of every first image.
//   read_capture CAPTURE
#include <exception>
#include <iostream>
#include <optional>

#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: read_capture CAPTURE\n";
    return 2;
  }
  try {
    // An index of what there is: images are opened one at a time, by the reader.
    atelier::FrameReader reader(atelier::open_dataset(arguments[1]));
    const atelier::Dataset& capture = reader.dataset();
    std::cout << "layout " << capture.layout << ", " << frame_ids(capture).size() << " frames\n";
    for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
      const atelier::Camera& camera = capture.cameras[c];
      std::cout << "camera " << camera.id << ": " << camera.width << " x " << camera.height
                << " pixels at (" << camera_center(camera).transpose() << ") m";
      if (!capture.frames[c].images.empty()) {
        const int frame_id = capture.frames[c].images.begin()->first;
        const std::optional<atelier::Image> image =
            reader.image(static_cast<atelier::Index>(c), frame_id);  // linear light
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < image->data.size(); ++i) {
          mean[static_cast<int>(i) % image->channels % 3] += image->data[i];
        }
        mean /= static_cast<double>(image->width) * image->height;
        std::cout << ", frame " << frame_id << " is (" << mean.transpose() << ") on average";
      }
      std::cout << "\n";
    }
    for (const atelier::Finding& finding : capture.findings) {
      std::cout << to_string(finding) << "\n";
    }
  } catch (const std::exception& error) {  // DataError says which file, where and what is wrong
    std::cerr << "read_capture: " << error.what() << "\n";
    return 3;
  }
}
