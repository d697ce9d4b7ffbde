// OpenCV's codecs of images behind C linkage, for core/io/image_opencv.cpp: a shared object of
// its own, since they bring a hundred others (GDAL, Poppler).
#include <opencv2/imgcodecs.hpp>
#include <vector>

extern "C" void atelier_decode_picture(const cv::Mat& encoded, int flags, cv::Mat& picture) {
  picture = cv::imdecode(encoded, flags);
}

extern "C" bool atelier_encode_picture(const char* extension, const cv::Mat& picture,
                                       const std::vector<int>& parameters,
                                       std::vector<unsigned char>& encoded) {
  return cv::imencode(extension, picture, encoded, parameters);
}
