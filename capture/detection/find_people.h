#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "capture/detection/person_landmarks.h"
#include "core/image.h"
#include "core/limits.h"
#include "core/options.h"

namespace atelier {

/// Size of the landmark network.
enum class LandmarkNetwork { Lite, Full, Heavy };

struct FindPeopleOptions {
  LandmarkNetwork network = LandmarkNetwork::Full;
  int people = 1;              ///< looked for in each image, 1 to 20
  double min_detection = 0.5;  ///< score of a detection that is looked at, [0.05, 1]
  double min_presence = 0.5;   ///< probability of a person in the crop, [0, 1]
};
OptionTable describe(FindPeopleOptions& options);

/// The files of the built-in detector, as scripts/detector-networks writes them.
struct PeopleNetworks {
  std::vector<std::byte> person;
  std::vector<std::byte> landmarks;
  std::string person_file;
  std::string landmarks_file;
};

/// Folder of the built-in detector's networks: $XDG_DATA_HOME/atelier/networks, where that variable
/// is not set ~/.local/share/atelier/networks; "" where neither is known.
std::string default_network_folder();

/// Reads the person detector and one landmark network of a folder. Throws EnvironmentError where
/// one is missing, with how to get it; DataError for one larger than 200 MB.
PeopleNetworks read_people_networks(const std::string& folder, LandmarkNetwork network);

/// The people of one image, whoever was surest first; in a sequence in the order of the image
/// before.
using PeopleInImage = std::vector<PersonLandmarks>;

/// Images of one camera in their order.
struct ImageSequence {
  std::vector<ByteImage> images;
  std::vector<PersonCrop> expected;  ///< in the first image: `next` of the people before
};

/// Finds people in each sequence as MediaPipe's published pipeline does: the detector looks at the
/// whole image, the landmark network at a crop round each person, and the landmarks say where the
/// crop of the next image is; the detector looks again when fewer people are followed than
/// `people`, and at once when one is lost. Two crops that arrive at the same person are one.
/// Networks and run are confined (run_network), in as many processes as loops use threads.
///
/// Returns [sequence][image]. Throws DataError (the network's file) as run_network and for networks
/// of other outputs; LogicError for images of other than 1 or 3 channels.
std::vector<std::vector<PeopleInImage>> find_people(const PeopleNetworks& networks,
                                                    const std::vector<ImageSequence>& sequences,
                                                    const FindPeopleOptions& options,
                                                    const Limits& limits = {});

/// One crop of an image in which somebody ought to be.
struct CropOfImage {
  const ByteImage* image = nullptr;
  PersonCrop crop;
};

/// The landmarks in each crop, whatever their presence. Throws as find_people.
std::vector<PersonLandmarks> landmarks_of_crops(const PeopleNetworks& networks,
                                                const std::vector<CropOfImage>& crops,
                                                const Limits& limits = {});

}  // namespace atelier
