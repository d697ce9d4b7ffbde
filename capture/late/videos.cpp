// OpenCV's videos behind C linkage, for capture/video_file.cpp: a shared object of its own, since
// they bring two hundred others (GStreamer, FFmpeg's codecs, GDAL).
#include <opencv2/videoio.hpp>

/// The caller deletes it; everything else of the class is virtual, so that the caller needs no
/// library to use it.
extern "C" cv::VideoCapture* atelier_new_video() {
  return new cv::VideoCapture;
}
