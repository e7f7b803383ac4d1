#include "planar_vslam/sensor/jpeg.h"

// clang-format off
#include <cstdio>  // jpeglib.h names FILE
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include <csetjmp>

namespace planar_vslam {
namespace {

// libjpeg's errors: a jump back to where the call of ours began. What it leaves must have no destructor.
struct ErrorExit {
  jpeg_error_mgr manager{};
  std::jmp_buf start{};
  bool bytes_ended = false;
  bool pixels_missing = false;  // since the bytes ended
};

template <class Info>
ErrorExit* ExitOf(Info* info) {
  return static_cast<ErrorExit*>(info->client_data);
}

[[noreturn]] void JumpBack(j_common_ptr info) { std::longjmp(ExitOf(info)->start, 1); }

// Where bytes run out, libjpeg goes on with grey and warns: nothing is written to stderr, the warnings are noted.
void NoteWarning(j_common_ptr info, int level) {
  if (level >= 0) return;  // a trace
  ErrorExit* exit = ExitOf(info);
  if (info->err->msg_code == JWRN_JPEG_EOF) exit->bytes_ended = true;
  if (info->err->msg_code == JWRN_HIT_MARKER && exit->bytes_ended) exit->pixels_missing = true;
}

template <class Info>
void SetErrors(Info* info, ErrorExit* exit) {
  info->err = jpeg_std_error(&exit->manager);
  info->err->error_exit = JumpBack;
  info->err->emit_message = NoteWarning;
  info->err->output_message = [](j_common_ptr) {};
  info->client_data = exit;
}

class Reader {
 public:
  Reader() { SetErrors(&info_, &exit_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { jpeg_destroy_decompress(&info_); }

  // The bytes must outlive the reader.
  bool ReadHeader(const std::vector<std::uint8_t>& bytes) {
    if (setjmp(exit_.start) != 0) return false;
    jpeg_create_decompress(&info_);
    jpeg_mem_src(&info_, bytes.data(), static_cast<unsigned long>(bytes.size()));
    return jpeg_read_header(&info_, TRUE) == JPEG_HEADER_OK;
  }
  std::size_t width() const { return info_.image_width; }
  std::size_t height() const { return info_.image_height; }

  // Writes width * height values. False where some are missing.
  bool ReadRows(std::uint8_t* pixels) {
    if (setjmp(exit_.start) != 0) return false;
    info_.out_color_space = JCS_GRAYSCALE;
    jpeg_start_decompress(&info_);
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = pixels + info_.output_scanline * width();
      if (jpeg_read_scanlines(&info_, &row, 1) != 1) return false;
    }
    const bool whole_scans_missing = exit_.bytes_ended && jpeg_has_multiple_scans(&info_) != 0;
    return !exit_.pixels_missing && !whole_scans_missing;
  }

 private:
  ErrorExit exit_;
  jpeg_decompress_struct info_{};
};

class Writer {
 public:
  Writer() { SetErrors(&info_, &exit_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { jpeg_destroy_compress(&info_); }

  // How many of the bytes were used; 0 on an error, one of which is that they do not suffice.
  std::size_t Write(const GrayImage& image, int quality, std::vector<std::uint8_t>* bytes) {
    if (setjmp(exit_.start) != 0) return 0;
    jpeg_create_compress(&info_);
    target_.next_output_byte = bytes->data();
    target_.free_in_buffer = bytes->size();
    target_.init_destination = target_.term_destination = [](j_compress_ptr) {};
    target_.empty_output_buffer = [](j_compress_ptr info) -> boolean {
      JumpBack(reinterpret_cast<j_common_ptr>(info));
    };
    info_.dest = &target_;
    info_.image_width = static_cast<JDIMENSION>(image.width);
    info_.image_height = static_cast<JDIMENSION>(image.height);
    info_.input_components = 1;
    info_.in_color_space = JCS_GRAYSCALE;
    jpeg_set_defaults(&info_);
    jpeg_set_quality(&info_, quality, TRUE);
    jpeg_start_compress(&info_, TRUE);
    while (info_.next_scanline < info_.image_height) {
      const std::size_t first = static_cast<std::size_t>(info_.next_scanline) * info_.image_width;
      JSAMPROW row = const_cast<JSAMPROW>(image.pixels->data() + first);  // only read
      jpeg_write_scanlines(&info_, &row, 1);
    }
    jpeg_finish_compress(&info_);
    return bytes->size() - target_.free_in_buffer;
  }

 private:
  ErrorExit exit_;
  jpeg_destination_mgr target_{};
  jpeg_compress_struct info_{};
};

// More than a grey JPEG takes at any quality: blocks can be larger than their pixels, and there are headers.
std::size_t LargestJpeg(const GrayImage& image) {
  constexpr std::size_t kBlock = 8, kHeaders = 2048;
  const std::size_t width = static_cast<std::size_t>(image.width) + kBlock;
  const std::size_t height = static_cast<std::size_t>(image.height) + kBlock;
  return 2 * width * height + kHeaders;
}

}  // namespace

std::optional<GrayImage> DecodeJpeg(const std::vector<std::uint8_t>& bytes) {
  Reader reader;
  if (!reader.ReadHeader(bytes) || reader.width() * reader.height() > kMaxDecodedPixels) return std::nullopt;
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(reader.width() * reader.height());
  if (!reader.ReadRows(pixels->data())) return std::nullopt;
  return GrayImage{static_cast<int>(reader.width()), static_cast<int>(reader.height()), std::move(pixels)};
}

std::optional<std::vector<std::uint8_t>> EncodeJpeg(const GrayImage& image, int quality) {
  if (image.empty() || image.width > JPEG_MAX_DIMENSION || image.height > JPEG_MAX_DIMENSION) return std::nullopt;
  std::vector<std::uint8_t> bytes(LargestJpeg(image));
  Writer writer;
  bytes.resize(writer.Write(image, quality, &bytes));
  if (bytes.empty()) return std::nullopt;
  return bytes;
}

}  // namespace planar_vslam
