// What tests ask of the C++ client: each command prints what it found, one thing per line.
#include "heptarm/heptarm.hpp"

#include <atomic>
#include <iostream>

namespace {

using namespace heptarm;

Bytes from_hex(const std::string& text) {
    Bytes out;
    for (std::size_t i = 0; i + 1 < text.size(); i += 2)
        out.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
    return out;
}

template <class Data>
std::string to_hex(const Data& data) {
    static const char* digits = "0123456789abcdef";
    std::string out;
    for (const std::uint8_t byte : data) {
        out += digits[byte >> 4];
        out += digits[byte & 15];
    }
    return out;
}

// Each line of the input is an id and a body: the body written again, and ok or the first violation.
void recode() {
    std::string line;
    while (std::getline(std::cin, line)) {
        const std::size_t blank = line.find(' ');
        const auto type = static_cast<std::uint16_t>(std::stoi(line.substr(0, blank)));
        const Bytes body = from_hex(line.substr(blank + 1));
        try {
            std::visit(
                [](const auto& message) {
                    std::cout << to_hex(wire::encode(message)) << " ";
                    try {
                        wire::validate(message);
                        std::cout << "ok\n";
                    } catch (const wire::Violation& found) {
                        std::cout << found.code << ":" << found.parameter << "\n";
                    }
                },
                wire::decode(type, body.data(), body.size()));
        } catch (const DecodeError& error) {
            std::cout << (std::strncmp(error.what(), "unknown message", 15) == 0 ? "unknown" : "undecodable") << "\n";
        }
    }
}

Frame frame_of(std::uint16_t type, const Bytes& body) {
    Frame frame;
    frame.type = type;
    frame.body = body;
    return frame;
}

// The golden vectors of the key, as the protocol page lists them.
void key_vectors(const std::string& secret, const Bytes& hello, const Bytes& challenge, const Bytes& welcome, std::int64_t time) {
    const auto first = wire::decode<wire::Hello>(hello.data(), hello.size());
    const auto second = wire::decode<wire::Challenge>(challenge.data(), challenge.size());
    key::Exchange exchange(secret);
    exchange.add(wire::Hello::TYPE, hello);
    exchange.add(wire::Challenge::TYPE, challenge);
    std::cout << "client_mac " << to_hex(exchange.client_mac()) << "\n";
    const auto [up, down] = exchange.keys(first.nonce, second.nonce);
    std::cout << "client_key " << to_hex(up) << "\ncabinet_key " << to_hex(down) << "\n";

    Session session(secret, first.nonce);
    session.pack(first, 0, time);
    const Bytes proof = session.proof(frame_of(wire::Challenge::TYPE, challenge), time);
    std::cout << "proof " << to_hex(Bytes(proof.begin() + Session::HEADER, proof.end())) << "\n";
    session.welcome(frame_of(wire::Welcome::TYPE, welcome));
    std::cout << "stop_frame " << to_hex(session.pack(wire::Stop{}, 1, time)) << "\n";
}

void print(const char* what, const Result& result) {
    std::cout << what << " " << wire::name(result.cause) << " " << result.residual << " " << result.duration << "\n";
}

Joints degrees(double a1, double a2, double a3, double a4, double a5, double a6, double a7) {
    Joints q{a1, a2, a3, a4, a5, a6, a7};
    for (double& one : q) one *= 3.14159265358979323846 / 180;
    return q;
}

const Joints READY = degrees(0, 30, 0, -90, 0, 60, 0);

Options options_of(const std::string& secret) {
    Options options;
    options.key = secret;
    options.name = "probe";
    options.timeout = 60;  // this machine may be busy
    options.watchdog = 5;
    return options;
}

void moves(const std::string& address, const std::string& secret) {
    Arm arm(address, options_of(secret));
    std::cout << "robot " << arm.welcome().robot.model << " " << arm.welcome().virtual_ << "\n";
    arm.take_control();
    std::cout << "controller " << arm.controller() << "\n";
    print("ptp", arm.move(ptp(READY, 0.5)));
    wire::Pose pose;
    const auto before = arm.wait_for_rest(60);
    pose.xyz = before.pose->xyz;
    pose.quat = before.pose->quat;
    pose.xyz[2] -= 0.05;
    print("lin", arm.move(lin(pose, 0.2)));
    const auto after = arm.wait_for_rest(60);
    std::cout << "down " << after.pose->xyz[2] - before.pose->xyz[2] << "\n";
    print("program", arm.move({lin_rel({0, 0, 0.03}, "base", 0.2), ptp(READY, 0.5)}));

    const Motion motion = arm.start(ptp(degrees(60, 30, 0, -90, 0, 60, 0), 0.2));
    motion.cancel();
    print("cancelled", motion.wait());
}

// A stream at 1 kHz: swings the last axis and ends at rest.
void serve(const std::string& address, double seconds) {
    Arm arm(address, options_of(""));
    arm.take_control();
    arm.move(ptp(READY, 0.5));
    ServoOptions options;
    options.rate = 1000;
    options.watchdog = 2;
    options.velocity = 0.5;
    options.acceleration = 1;
    Servo servo = arm.servo(options);
    const Joints start = servo.start();
    long sent = 0;
    double widest = 0;
    while (servo.tick() && servo.t() < seconds) {
        Joints q = start;
        q[6] += 0.2 * std::sin(2 * servo.t());
        servo.set(q);
        ++sent;
        widest = std::max(widest, std::fabs(arm.state().joints->q[6] - start[6]));
    }
    print("servo", servo.close());
    const auto status = servo.status();
    std::cout << "sent " << sent << "\nreceived " << status->targets << "\nrefused " << status->refused << "\nwidest " << widest
              << "\nage " << status->age_median << "\n";
}

template <class Action>
void expect(const char* what, Action action) {
    try {
        action();
        std::cout << what << " nothing\n";
    } catch (const NotInControl& error) {
        std::cout << what << " NotInControl " << error.code << " " << error.what() << "\n";
    } catch (const LimitError& error) {
        std::cout << what << " LimitError " << error.code << " " << error.parameter << " " << error.what() << "\n";
    } catch (const CommandRejected& error) {
        std::cout << what << " CommandRejected " << error.code << " " << error.what() << "\n";
    } catch (const MotionAborted& error) {
        std::cout << what << " MotionAborted " << error.code << " " << error.what() << "\n";
    } catch (const Starved& error) {
        std::cout << what << " Starved " << error.code << " " << error.what() << "\n";
    } catch (const VersionMismatch& error) {
        std::cout << what << " VersionMismatch " << error.code << " " << error.what() << "\n";
    } catch (const ConnectFailed& error) {
        std::cout << what << " ConnectFailed " << error.code << " " << error.what() << "\n";
    } catch (const ConnectionLost& error) {
        std::cout << what << " ConnectionLost " << error.code << " " << error.what() << "\n";
    } catch (const Error& error) {
        std::cout << what << " Error " << error.code << " " << error.what() << "\n";
    }
    std::cout.flush();
}

void errors(const std::string& address) {
    Arm observer(address, options_of(""));
    expect("observer", [&] { observer.move(ptp(READY)); });
    Arm arm(address, options_of(""));
    arm.take_control();
    expect("second", [&] { observer.take_control(); });
    expect("limit", [&] { arm.move(ptp(degrees(0, 150, 0, -90, 0, 60, 0))); });
    expect("unset", [&] { arm.move(ptp(Joints{unset, 0, 0, 0, 0, 0, 0})); });
    expect("speed", [&] { arm.move(ptp(READY, 1.5)); });
    expect("unplanned", [&] { arm.move(lin_rel({3, 0, 0})); });
    arm.move(ptp(READY, 0.5));
    const Motion motion = arm.start(ptp(degrees(60, 30, 0, -90, 0, 60, 0), 0.2));
    observer.stop();
    expect("stopped", [&] { motion.wait(); });
    halt(address);
    std::cout << "halted\n";
    expect("starved", [&] {
        ServoOptions options;
        options.watchdog = 0.05;
        Servo servo = arm.servo(options);
        servo.set(READY);
        while (servo.active()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        servo.close();
    });
    std::cout << "moved again " << wire::name(arm.move(ptp(READY, 0.5)).cause) << "\n";
}

// States for a while, as an observer.
void observe(const std::string& address, double rate, std::uint64_t count) {
    Options options = options_of("");
    options.rate = rate;
    std::atomic<std::uint64_t> called{0};
    options.on_state = [&](const wire::State&) { ++called; };
    Arm arm(address, options);
    std::int64_t last = 0;
    std::uint64_t seen = 0, number = 0, wrong = 0;
    while (number < count) {
        const auto sample = arm.next_state(number);
        wrong += sample.state.joints->stamp < last;
        last = sample.state.joints->stamp;
        number = sample.number;
        ++seen;
    }
    std::cout << "seen " << seen << " of " << number << ", called " << called << ", out of order " << wrong << ", controller "
              << (arm.controller().empty() ? "nobody" : arm.controller()) << "\n";
}

// Says when it has a state, waits for a line, and says whether newer states come.
void wait_for_line(const std::string& address) {
    Arm arm(address, options_of(""));
    const auto number = arm.next_state(0).number;
    std::cout << "ready" << std::endl;
    std::string line;
    std::getline(std::cin, line);
    arm.next_state(number + 1);
    std::cout << "alive\n";
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> words(argv + 1, argv + argc);
    const auto word = [&](std::size_t i) { return i < words.size() ? words[i] : std::string(); };
    try {
        if (word(0) == "recode") recode();
        if (word(0) == "key") key_vectors(word(1), from_hex(word(2)), from_hex(word(3)), from_hex(word(4)), std::stoll(word(5)));
        if (word(0) == "move") moves(word(1), word(2));
        if (word(0) == "servo") serve(word(1), std::stod(word(2)));
        if (word(0) == "errors") errors(word(1));
        if (word(0) == "observe") observe(word(1), std::stod(word(2)), std::stoul(word(3)));
        if (word(0) == "wait") wait_for_line(word(1));
        if (word(0) == "connect") expect("connect", [&] { Arm(word(1), options_of(word(2))); });
    } catch (const Error& error) {
        std::cerr << error.what() << "\n";
        return 1;
    }
    return 0;
}
