// FRI's wire format, as much of it as a client needs: Protocol Buffers (version 2) by hand, and 2.7's frame.
// Written from the format alone; contains no code of KUKA.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace fri {

enum State { IDLE, MONITORING_WAIT, MONITORING_READY, COMMANDING_WAIT, COMMANDING_ACTIVE };
enum Mode { NONE, POSITION, WRENCH, TORQUE, POSE };

using Numbers = std::vector<double>;

struct Pose {
    std::string name;
    Numbers values;  // x y z [mm], quaternion w x y z
    double a3 = 0;   // redundancy [rad]
};

struct Monitoring {
    uint32_t counter = 0;
    int state = IDLE, period = 0, multiplier = 1, mode = NONE;
    Numbers measured, commanded, ipo;  // joints [rad]
    Pose measured_pose, ipo_pose;
};

struct Command {
    uint32_t counter = 0, reflected = 0;
    Numbers q, tau, wrench;
    Pose pose;
};

constexpr uint32_t MONITORING_ID = 0x245142, COMMAND_ID = 0x34001;

inline uint32_t crc32(const uint8_t* data, size_t size) {
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0; i < size; ++i) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xEDB88320u : 0u);
    }
    return ~crc;
}

inline uint32_t little(const uint8_t* data) {
    return data[0] | data[1] << 8 | data[2] << 16 | uint32_t(data[3]) << 24;
}

// ------------------------------------------------------------------------------------------------ reading

class Reader {
public:
    Reader(const uint8_t* begin, const uint8_t* end) : at_(begin), end_(end) {}

    // The next field; false at the end.
    bool next() {
        if (at_ == end_) return false;
        uint64_t key = varint();
        tag = int(key >> 3);
        kind_ = int(key & 7);
        if (kind_ == 0) {
            number = varint();
        } else if (kind_ == 1) {
            number = 0;
            std::memcpy(&number, take(8), 8);  // this machine is little endian, as FRI is
        } else if (kind_ == 2) {
            size_ = size_t(varint());
            bytes_ = take(size_);
        } else {
            throw std::runtime_error("a field of an unknown kind");
        }
        return true;
    }

    Reader inner() const { return Reader(bytes_, bytes_ + size_); }
    std::string text() const { return std::string(reinterpret_cast<const char*>(bytes_), size_); }

    double real() const {
        double value;
        std::memcpy(&value, &number, 8);
        return value;
    }

    // Numbers of a repeated field, one by one or packed.
    void append(Numbers& values) const {
        if (kind_ == 1) values.push_back(real());
        for (size_t i = 0; kind_ == 2 && i + 8 <= size_; i += 8) {
            double value;
            std::memcpy(&value, bytes_ + i, 8);
            values.push_back(value);
        }
    }

    int tag = 0;
    uint64_t number = 0;

private:
    const uint8_t* take(size_t size) {
        if (size_t(end_ - at_) < size) throw std::runtime_error("a truncated message");
        const uint8_t* here = at_;
        at_ += size;
        return here;
    }

    uint64_t varint() {
        uint64_t value = 0;
        for (int shift = 0; shift < 64; shift += 7) {
            uint8_t byte = *take(1);
            value |= uint64_t(byte & 0x7F) << shift;
            if (!(byte & 0x80)) return value;
        }
        throw std::runtime_error("an endless number");
    }

    const uint8_t *at_, *end_, *bytes_ = nullptr;
    size_t size_ = 0;
    int kind_ = 0;
};

inline Numbers numbers(Reader message, int tag) {
    Numbers values;
    while (message.next())
        if (message.tag == tag) message.append(values);
    return values;
}

inline void read_pose(Reader message, Pose& pose) {
    pose.values = numbers(message, 2);
    while (message.next())
        if (message.tag == 1) pose.name = message.text();
}

inline double read_redundancy(Reader message) {
    double value = 0;
    while (message.next())
        if (message.tag == 2) value = message.real();
    return value;
}

inline Monitoring read(const uint8_t* data, size_t size) {
    if (size >= 8 && little(data) == size - 8) {  // 2.7: length, message, checksum
        if (crc32(data + 4, size - 8) != little(data + size - 4)) throw std::runtime_error("a wrong checksum");
        data += 4;
        size -= 8;
    }
    Monitoring found;
    uint32_t id = 0;
    for (Reader message(data, data + size); message.next();) {
        if (message.tag == 1) {
            for (Reader header = message.inner(); header.next();) {
                if (header.tag == 1) id = uint32_t(header.number);
                if (header.tag == 2) found.counter = uint32_t(header.number);
            }
        } else if (message.tag == 3) {
            for (Reader state = message.inner(); state.next();) {
                if (state.tag == 1) found.measured = numbers(state.inner(), 1);
                if (state.tag == 3) found.commanded = numbers(state.inner(), 1);
                if (state.tag == 9) read_pose(state.inner(), found.measured_pose);
                if (state.tag == 10) found.measured_pose.a3 = read_redundancy(state.inner());
            }
        } else if (message.tag == 4) {
            for (Reader session = message.inner(); session.next();) {
                if (session.tag == 1) found.state = int(session.number);
                if (session.tag == 3) found.period = int(session.number);
                if (session.tag == 4) found.multiplier = int(session.number);
            }
        } else if (message.tag == 5) {
            for (Reader ipo = message.inner(); ipo.next();) {
                if (ipo.tag == 1) found.ipo = numbers(ipo.inner(), 1);
                if (ipo.tag == 2) read_pose(ipo.inner(), found.ipo_pose);
                if (ipo.tag == 3) found.ipo_pose.a3 = read_redundancy(ipo.inner());
                if (ipo.tag == 10) found.mode = int(ipo.number);
            }
        }
    }
    if (id != MONITORING_ID) throw std::runtime_error("not a monitoring message");
    return found;
}

// ------------------------------------------------------------------------------------------------ writing

class Writer {
public:
    void varint(uint64_t value) {
        for (; value > 0x7F; value >>= 7) data.push_back(char(value | 0x80));
        data.push_back(char(value));
    }
    void number(int tag, uint64_t value) {
        varint(uint64_t(tag) << 3);
        varint(value);
    }
    void bytes(int tag, const std::string& value) {
        varint(uint64_t(tag) << 3 | 2);
        varint(value.size());
        data += value;
    }
    void real(int tag, double value) {
        varint(uint64_t(tag) << 3 | 1);
        raw(value);
    }
    void raw(double value) { data.append(reinterpret_cast<const char*>(&value), 8); }

    std::string data;
};

inline std::string joints(const Numbers& values) {
    Writer message;
    for (double value : values) message.real(1, value);
    return message.data;
}

inline std::string packed(const Numbers& values) {
    Writer content;
    for (double value : values) content.raw(value);
    return content.data;
}

inline std::string write(const Command& command, bool framed) {
    Writer header, content, message;
    header.number(1, COMMAND_ID);
    header.number(2, command.counter);
    header.number(3, command.reflected);
    message.bytes(1, header.data);
    if (!command.q.empty()) content.bytes(1, joints(command.q));
    if (!command.wrench.empty()) {
        Writer vector;
        vector.bytes(1, packed(command.wrench));
        content.bytes(2, vector.data);
    }
    if (!command.tau.empty()) content.bytes(3, joints(command.tau));
    if (!command.pose.values.empty()) {
        Writer pose, redundancy;
        pose.bytes(1, command.pose.name);
        pose.bytes(2, packed(command.pose.values));
        content.bytes(6, pose.data);
        redundancy.number(1, 0);  // the value is the angle of A3
        redundancy.real(2, command.pose.a3);
        content.bytes(7, redundancy.data);
    }
    if (!content.data.empty()) message.bytes(2, content.data);
    if (!framed) return message.data;
    std::string datagram;
    auto put = [&datagram](uint32_t value) {
        for (int shift = 0; shift < 32; shift += 8) datagram.push_back(char(value >> shift));
    };
    put(uint32_t(message.data.size()));
    datagram += message.data;
    put(crc32(reinterpret_cast<const uint8_t*>(message.data.data()), message.data.size()));
    return datagram;
}

}  // namespace fri
