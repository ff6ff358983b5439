// ------------------------------------------------------------------------------------------------ key

namespace heptarm {
namespace key {

using Digest = std::array<std::uint8_t, 32>;

/// SHA-256 (FIPS 180-4); a copy goes on from where the original was.
class Sha256 {
public:
    Sha256& update(const std::uint8_t* data, std::size_t size) {
        total_ += size;
        while (size > 0) {
            const std::size_t part = std::min(size, block_.size() - filled_);
            std::memcpy(block_.data() + filled_, data, part);
            filled_ += part;
            data += part;
            size -= part;
            if (filled_ == block_.size()) {
                compress();
                filled_ = 0;
            }
        }
        return *this;
    }

    Sha256& update(const Bytes& data) { return update(data.data(), data.size()); }

    Digest digest() const {
        Sha256 last = *this;
        const std::uint64_t bits = 8 * total_;
        const std::uint8_t one = 0x80, zero = 0;
        last.update(&one, 1);
        while (last.filled_ != 56) last.update(&zero, 1);
        std::uint8_t length[8];
        for (int i = 0; i < 8; ++i) length[i] = static_cast<std::uint8_t>(bits >> (56 - 8 * i));
        last.update(length, 8);
        Digest out;
        for (std::size_t i = 0; i < 32; ++i) out[i] = static_cast<std::uint8_t>(last.state_[i / 4] >> (24 - 8 * (i % 4)));
        return out;
    }

private:
    static std::uint32_t turned(std::uint32_t x, int n) { return x >> n | x << (32 - n); }

    void compress() {
        static constexpr std::uint32_t K[64] = {
            0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
            0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
            0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
            0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
            0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
            0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
            0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
            0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};
        std::uint32_t w[64];
        for (std::size_t i = 0; i < 16; ++i)
            w[i] = std::uint32_t(block_[4 * i]) << 24 | std::uint32_t(block_[4 * i + 1]) << 16 |
                   std::uint32_t(block_[4 * i + 2]) << 8 | block_[4 * i + 3];
        for (std::size_t i = 16; i < 64; ++i) {
            const std::uint32_t a = w[i - 15], b = w[i - 2];
            w[i] = w[i - 16] + (turned(a, 7) ^ turned(a, 18) ^ a >> 3) + w[i - 7] +
                   (turned(b, 17) ^ turned(b, 19) ^ b >> 10);
        }
        auto [a, b, c, d, e, f, g, h] = state_;
        for (std::size_t i = 0; i < 64; ++i) {
            const std::uint32_t t1 =
                h + (turned(e, 6) ^ turned(e, 11) ^ turned(e, 25)) + ((e & f) ^ (~e & g)) + K[i] + w[i];
            const std::uint32_t t2 = (turned(a, 2) ^ turned(a, 13) ^ turned(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
            h = g;
            g = f;
            f = e;
            e = d + t1;
            d = c;
            c = b;
            b = a;
            a = t1 + t2;
        }
        const std::uint32_t sums[8] = {a, b, c, d, e, f, g, h};
        for (std::size_t i = 0; i < 8; ++i) state_[i] += sums[i];
    }

    std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<std::uint8_t, 64> block_{};
    std::size_t filled_ = 0;
    std::uint64_t total_ = 0;
};

/// HMAC-SHA-256 (RFC 2104) whose hash states are prepared once.
class Hmac {
public:
    explicit Hmac(const Bytes& key) {
        std::array<std::uint8_t, 64> block{};
        if (key.size() > block.size()) {
            const Digest hash = Sha256().update(key).digest();
            std::copy(hash.begin(), hash.end(), block.begin());
        } else {
            std::copy(key.begin(), key.end(), block.begin());
        }
        for (std::uint8_t& byte : block) byte ^= 0x36;
        inner_.update(block.data(), block.size());
        for (std::uint8_t& byte : block) byte ^= 0x36 ^ 0x5C;
        outer_.update(block.data(), block.size());
    }

    Digest operator()(const Bytes& message) const { return finish(Sha256(inner_).update(message)); }

    /// Of a number and bytes that follow it.
    Digest operator()(std::uint32_t number, const std::uint8_t* data, std::size_t size) const {
        std::uint8_t head[4];
        for (int i = 0; i < 4; ++i) head[i] = static_cast<std::uint8_t>(number >> (24 - 8 * i));
        return finish(Sha256(inner_).update(head, 4).update(data, size));
    }

private:
    Digest finish(const Sha256& inner) const {
        const Digest hash = inner.digest();
        return Sha256(outer_).update(hash.data(), hash.size()).digest();
    }

    Sha256 inner_, outer_;
};

inline Bytes bytes(const Digest& digest) { return Bytes(digest.begin(), digest.end()); }

/// HKDF-SHA-256 (RFC 5869) of one block: 32 bytes.
inline Bytes hkdf(const Bytes& secret, const Bytes& salt, const std::string& info) {
    Bytes block(info.begin(), info.end());
    block.push_back(1);
    return bytes(Hmac(bytes(Hmac(salt)(secret)))(block));
}

/// Compares without revealing by its time where the difference is.
inline bool same(const std::uint8_t* a, const std::uint8_t* b, std::size_t size) {
    std::uint8_t difference = 0;
    for (std::size_t i = 0; i < size; ++i) difference = static_cast<std::uint8_t>(difference | (a[i] ^ b[i]));
    return difference == 0;
}

/// What a key proves in one handshake.
class Exchange {
public:
    explicit Exchange(const std::string& key) : key_(key.begin(), key.end()) {}

    /// Adds the next message of the handshake: its id and its body.
    void add(std::uint16_t type, const Bytes& body) {
        wire::Writer out(parts_);
        out.put(type);
        out.put(body);  // a u32 length, then the bytes
    }

    /// The client's proof, after Hello and Challenge.
    Digest client_mac() const { return mac("heptarm client"); }

    /// The cabinet's proof, after Hello, Challenge, Proof and the Welcome with an empty mac.
    Digest cabinet_mac() const { return mac("heptarm cabinet"); }

    /// Keys of the session: of the client's frames and of the cabinet's.
    std::pair<Bytes, Bytes> keys(const Bytes& client_nonce, const Bytes& cabinet_nonce) const {
        Bytes salt = client_nonce;
        salt.insert(salt.end(), cabinet_nonce.begin(), cabinet_nonce.end());
        return {hkdf(key_, salt, "heptarm client to cabinet"), hkdf(key_, salt, "heptarm cabinet to client")};
    }

private:
    Digest mac(const char* role) const {
        Bytes data(role, role + std::strlen(role) + 1);  // with its 0
        data.insert(data.end(), parts_.begin(), parts_.end());
        return Hmac(key_)(data);
    }

    Bytes key_, parts_;
};

}  // namespace key
}  // namespace heptarm

