#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <fstream>
#include <limits>
#include <map>
#include <vector>

#include "bag_bytes.h"
#include "bag_mcap.h"
#include "bag_sink.h"

namespace planar_vslam::io {
namespace {

template <class Number>
void Put(Number number, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&number), sizeof(Number));
}

template <class Length = std::uint32_t>
void PutBlock(std::string_view block, std::string* bytes) {
  Put(static_cast<Length>(block.size()), bytes);
  bytes->append(block);
}

void PutRecord(McapRecord type, std::string_view content, std::string* bytes) {
  bytes->push_back(static_cast<char>(type));
  PutBlock<std::uint64_t>(content, bytes);
}

std::uint32_t Checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string Pack(const std::string& records, const std::string& compression) {
  if (compression.empty()) return records;
  const bool zstd = compression == "zstd";
  std::string packed(zstd ? ZSTD_compressBound(records.size()) : LZ4F_compressFrameBound(records.size(), nullptr),
                     '\0');
  const std::size_t size =
      zstd ? ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), ZSTD_CLEVEL_DEFAULT)
           : LZ4F_compressFrame(packed.data(), packed.size(), records.data(), records.size(), nullptr);
  if ((zstd ? ZSTD_isError(size) : LZ4F_isError(size)) != 0) throw BadBag{"a chunk cannot be compressed"};
  packed.resize(size);
  return packed;
}

struct Times {
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max(), last = 0;
  void Add(std::uint64_t time) {
    first = std::min(first, time);
    last = std::max(last, time);
  }
};

class McapWriter : public MessageSink {
 public:
  McapWriter(const std::filesystem::path& path, McapLayout layout)
      : file_(path, std::ios::binary), layout_(std::move(layout)) {
    std::string bytes(kMcapMagic), header;
    PutBlock("ros2", &header);
    PutBlock("planar_vslam", &header);
    PutRecord(McapRecord::kHeader, header, &bytes);
    Append(bytes);
  }
  void Write(const std::string& topic, const std::string& type, std::int64_t recorded, std::string_view data) override;
  void Close() override;

 private:
  struct Channel {
    std::uint16_t id;
    std::string schema, channel;  // their records' contents
    std::uint64_t messages = 0;
    std::string index;  // of the chunk being written
  };
  void Append(std::string_view bytes);
  Channel& ChannelOf(const std::string& topic, const std::string& type);
  void WriteChunk();
  std::string Summary() const;

  std::ofstream file_;
  McapLayout layout_;
  std::uint64_t size_ = 0;
  std::map<std::string, Channel> channels_;  // by topic
  std::string chunk_;
  Times chunk_times_, times_;
  std::vector<std::string> chunk_indexes_;
};

void McapWriter::Append(std::string_view bytes) {
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  size_ += bytes.size();
  if (!file_) throw BadBag{"the disk does not take it"};
}

McapWriter::Channel& McapWriter::ChannelOf(const std::string& topic, const std::string& type) {
  const auto known = channels_.find(topic);
  if (known != channels_.end()) return known->second;
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);  // zero is none of schemas
  Channel channel{id, "", "", 0, ""};
  Put(id, &channel.schema);
  PutBlock(Ros2Type(type), &channel.schema);
  PutBlock("ros2msg", &channel.schema);
  PutBlock(Ros2Definition(type), &channel.schema);
  Put(id, &channel.channel);
  Put(id, &channel.channel);
  PutBlock(topic, &channel.channel);
  PutBlock("cdr", &channel.channel);
  std::string metadata;
  if (const std::string qos = OfferedQos(topic); !qos.empty()) {
    PutBlock("offered_qos_profiles", &metadata);
    PutBlock(qos, &metadata);
  }
  PutBlock(metadata, &channel.channel);
  PutRecord(McapRecord::kSchema, channel.schema, &chunk_);
  PutRecord(McapRecord::kChannel, channel.channel, &chunk_);
  return channels_.emplace(topic, std::move(channel)).first->second;
}

void McapWriter::Write(const std::string& topic, const std::string& type, std::int64_t recorded,
                       std::string_view data) {
  Channel& channel = ChannelOf(topic, type);
  const auto time = static_cast<std::uint64_t>(recorded);
  std::string message;
  Put(channel.id, &message);
  Put(static_cast<std::uint32_t>(channel.messages++), &message);
  Put(time, &message);
  Put(time, &message);
  message.append(data);
  if (layout_.chunks) {
    Put(time, &channel.index);
    Put(static_cast<std::uint64_t>(chunk_.size()), &channel.index);
  }
  PutRecord(McapRecord::kMessage, message, &chunk_);
  chunk_times_.Add(time);
  times_.Add(time);
  constexpr std::size_t kChunk = std::size_t{768} * 1024;  // bytes, as the recorder's default
  if (!layout_.chunks) {
    Append(chunk_);
    chunk_.clear();
  } else if (chunk_.size() >= kChunk) {
    WriteChunk();
  }
}

void McapWriter::WriteChunk() {
  std::string content, record;
  Put(chunk_times_.first, &content);
  Put(chunk_times_.last, &content);
  Put(static_cast<std::uint64_t>(chunk_.size()), &content);
  Put(Checksum(chunk_), &content);
  PutBlock(layout_.compression, &content);
  const std::string packed = Pack(chunk_, layout_.compression);
  PutBlock<std::uint64_t>(packed, &content);
  PutRecord(McapRecord::kChunk, content, &record);
  const std::uint64_t chunk_start = size_, chunk_length = record.size();
  std::string offsets;
  for (auto& [topic, channel] : channels_) {
    if (channel.index.empty()) continue;
    Put(channel.id, &offsets);
    Put(static_cast<std::uint64_t>(chunk_start + record.size()), &offsets);
    std::string index;
    Put(channel.id, &index);
    PutBlock(channel.index, &index);
    PutRecord(McapRecord::kMessageIndex, index, &record);
    channel.index.clear();
  }
  Append(record);
  std::string chunk_index;
  for (const std::uint64_t number : {chunk_times_.first, chunk_times_.last, chunk_start, chunk_length}) {
    Put(number, &chunk_index);
  }
  PutBlock(offsets, &chunk_index);
  Put(static_cast<std::uint64_t>(record.size() - chunk_length), &chunk_index);
  PutBlock(layout_.compression, &chunk_index);
  Put(static_cast<std::uint64_t>(packed.size()), &chunk_index);
  Put(static_cast<std::uint64_t>(chunk_.size()), &chunk_index);
  chunk_indexes_.push_back(std::move(chunk_index));
  chunk_.clear();
  chunk_times_ = {};
}

std::string McapWriter::Summary() const {
  std::string summary, statistics, counts;
  std::uint64_t messages = 0;
  for (const auto& [topic, channel] : channels_) {
    PutRecord(McapRecord::kSchema, channel.schema, &summary);
    messages += channel.messages;
    Put(channel.id, &counts);
    Put(channel.messages, &counts);
  }
  for (const auto& [topic, channel] : channels_) PutRecord(McapRecord::kChannel, channel.channel, &summary);
  Put(messages, &statistics);
  Put(static_cast<std::uint16_t>(channels_.size()), &statistics);
  Put(static_cast<std::uint32_t>(channels_.size()), &statistics);
  Put(std::uint32_t{0}, &statistics);  // attachments
  Put(std::uint32_t{0}, &statistics);  // metadata
  Put(static_cast<std::uint32_t>(chunk_indexes_.size()), &statistics);
  Put(messages == 0 ? 0 : times_.first, &statistics);
  Put(times_.last, &statistics);
  PutBlock(counts, &statistics);
  PutRecord(McapRecord::kStatistics, statistics, &summary);
  for (const std::string& index : chunk_indexes_) PutRecord(McapRecord::kChunkIndex, index, &summary);
  return summary;
}

void McapWriter::Close() {
  if (layout_.chunks && !chunk_.empty()) WriteChunk();
  std::string bytes, content;
  Put(std::uint32_t{0}, &content);  // the data's checksum: chunks have theirs
  PutRecord(McapRecord::kDataEnd, content, &bytes);
  Append(bytes);
  bytes = layout_.summary ? Summary() : "";
  const std::uint64_t summary_start = layout_.summary ? size_ : 0;
  std::string footer;
  Put(summary_start, &footer);
  Put(std::uint64_t{0}, &footer);  // no offsets into the summary
  // The checksum takes in the footer up to itself.
  constexpr std::uint64_t kFooterBytes = 8 + 8 + 4;
  std::string summed = bytes;
  summed.push_back(static_cast<char>(McapRecord::kFooter));
  Put(kFooterBytes, &summed);
  summed += footer;
  Put(layout_.summary ? Checksum(summed) : 0, &footer);
  PutRecord(McapRecord::kFooter, footer, &bytes);
  bytes += kMcapMagic;
  Append(bytes);
  file_.close();
  if (!file_) throw BadBag{"the disk does not take it"};
}

}  // namespace

std::unique_ptr<MessageSink> CreateMcap(const std::filesystem::path& path, const McapLayout& layout) {
  return std::make_unique<McapWriter>(path, layout);
}

std::unique_ptr<MessageSink> CreateSink(const std::filesystem::path& path) {
  if (path.extension() == ".mcap") return CreateMcap(path);
  if (path.extension() == ".db3") return CreateSqliteBag(path);
  return nullptr;
}

}  // namespace planar_vslam::io
