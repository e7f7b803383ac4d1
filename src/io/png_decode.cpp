#include "png_decode.h"

#include <png.h>

#include <csetjmp>
#include <cstring>

#include "planar_vslam/sensor/jpeg.h"

namespace planar_vslam::io {
namespace {

// An error of libpng jumps back to where the call of ours began. What it leaves must have no destructor.
class PngReader {
 public:
  // The bytes must outlive the reader.
  explicit PngReader(const std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }

  bool ReadHeader() {
    if (setjmp(start_) != 0) return false;
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, JumpBack, [](png_structp, png_const_charp) {});
    if (png_ == nullptr) return false;
    info_ = png_create_info_struct(png_);
    if (info_ == nullptr) return false;
    png_set_read_fn(png_, this, TakeBytes);
    png_read_info(png_, info_);
    return true;
  }
  std::size_t width() const { return png_get_image_width(png_, info_); }
  std::size_t height() const { return png_get_image_height(png_, info_); }

  // Whether a value is two bytes wide, the high one first: grey of 16 bits.
  bool wide() const {
    return png_get_bit_depth(png_, info_) == 16 && (png_get_color_type(png_, info_) & PNG_COLOR_MASK_COLOR) == 0;
  }

  // Each row has room for width values.
  bool ReadRows(png_bytepp rows) {
    if (setjmp(start_) != 0) return false;
    const int color_type = png_get_color_type(png_, info_);
    if (!wide()) png_set_strip_16(png_);
    png_set_strip_alpha(png_);
    if (color_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (color_type == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png_);
    png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, kRed, kGreen);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    if (png_get_rowbytes(png_, info_) != width() * (wide() ? 2 : 1)) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

 private:
  static constexpr double kRed = 0.299, kGreen = 0.587;

  [[noreturn]] static void JumpBack(png_structp png, png_const_charp /*message*/) {
    std::longjmp(static_cast<PngReader*>(png_get_error_ptr(png))->start_, 1);
  }
  static void TakeBytes(png_structp png, png_bytep target, png_size_t count) {
    auto* self = static_cast<PngReader*>(png_get_io_ptr(png));
    if (count > self->bytes_.size() - self->taken_) png_error(png, "too few bytes");
    std::memcpy(target, self->bytes_.data() + self->taken_, count);
    self->taken_ += count;
  }

  const std::vector<std::uint8_t>& bytes_;
  std::size_t taken_ = 0;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf start_{};
};

}  // namespace

std::optional<GrayImage> DecodePng(const std::vector<std::uint8_t>& bytes, GreyDepth* depth) {
  PngReader reader(bytes);
  if (!reader.ReadHeader() || reader.width() * reader.height() > kMaxDecodedPixels) return std::nullopt;
  const bool wide = reader.wide();
  const std::size_t row_bytes = reader.width() * (wide ? 2 : 1);
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(row_bytes * reader.height());
  std::vector<png_bytep> rows(reader.height());
  for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = pixels->data() + row * row_bytes;
  if (!reader.ReadRows(rows.data())) return std::nullopt;
  if (wide) {
    depth->NarrowBigEndian(pixels->data(), pixels->size() / 2, pixels->data());
    pixels->resize(pixels->size() / 2);
  }
  return GrayImage{static_cast<int>(reader.width()), static_cast<int>(reader.height()), std::move(pixels)};
}

}  // namespace planar_vslam::io
