/* The FRI messages of a client, versions 1.11 to 2.7: monitoring messages are read, commands are written.

   Protocol buffers (proto2) after their public description. Reading is strict: a message with a field of another wire type, an
   unknown member of an enumeration or a wrong number of values is refused, and `why` says so; fields that FRI does not have are
   skipped, and of a repeated field the last one counts. The controller's side of the codec is heptarm.fri.protocol.codec. */
#include <stdarg.h>
#include <stdio.h>

#include "fri.h"

enum { VARINT = 0, FIXED64 = 1, BYTES = 2, FIXED32 = 5, TAGS = 16 };

const char *const fri_version_names[] = {"1.11", "1.14-1.16", "2.5", "2.7"};

int fri_is_framed(int version) { return version == V2_7; }

int fri_has_quaternions(int version) { return version == V2_5 || version == V2_7; }

int fri_same_name(const struct name *a, const struct name *b) {
    return a->size == b->size && !memcmp(a->bytes, b->bytes, (size_t)a->size);
}

/* ----------------------------------------------------------------------------------------------------------- reading */

struct part {
    const uint8_t *begin, *at, *end;
};

/* The last field of a tag: `kind` is ABSENT where there is none. */
struct field {
    int kind;
    uint64_t number;
    struct part bytes;
};

__attribute__((format(printf, 2, 3))) static int refuse(char *why, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, TEXT, format, arguments);
    va_end(arguments);
    return 0;
}

static int varint(struct part *p, uint64_t *value, char *why) {
    *value = 0;
    for (int shift = 0; shift < 64 && p->at < p->end; shift += 7) {
        uint8_t byte = *p->at++;
        *value |= (uint64_t)(byte & 0x7f) << shift;
        if (byte < 0x80) {
            if (shift == 63 && byte > 1) break;
            return 1;
        }
    }
    return refuse(why, "FRI message: the varint that ends at byte %d is incomplete or too long", (int)(p->at - p->begin));
}

/* Read the next field and its tag. */
static int next_field(struct part *p, uint64_t *tag, struct field *f, char *why) {
    uint64_t key, size;
    if (!varint(p, &key, why)) return 0;
    *tag = key >> 3;
    f->kind = (int)(key & 7);
    f->number = 0;
    switch (f->kind) {
    case VARINT: return varint(p, &f->number, why);
    case BYTES:
        if (!varint(p, &size, why)) return 0;
        break;
    case FIXED64: size = 8; break;
    case FIXED32: size = 4; break;
    default:
        return refuse(why, "FRI message: field %llu at byte %d has the unknown wire type %d", (unsigned long long)*tag,
                      (int)(p->at - p->begin), f->kind);
    }
    if (*tag == 0 || size > (uint64_t)(p->end - p->at))
        return refuse(why, "FRI message: field %llu at byte %d is incomplete (%llu bytes expected, %d left)",
                      (unsigned long long)*tag, (int)(p->at - p->begin), (unsigned long long)size, (int)(p->end - p->at));
    f->bytes.begin = f->bytes.at = p->at;
    p->at += size;
    f->bytes.end = p->at;
    if (f->kind == FIXED32) {
        uint32_t fixed;
        memcpy(&fixed, f->bytes.at, 4);
        f->number = fixed;
    }
    return 1;
}

/* Read all fields: the last one of each tag. */
static int collect(struct part p, struct field *last, char *why) {
    uint64_t tag;
    struct field f;
    for (int i = 0; i < TAGS; i++) last[i].kind = ABSENT;
    p.begin = p.at;
    while (p.at < p.end) {
        if (!next_field(&p, &tag, &f, why)) return 0;
        if (tag < TAGS) last[tag] = f;
    }
    return 1;
}

static int has(const struct field *f) { return f->kind != ABSENT; }

static int is_kind(const struct field *f, int kind, const char *name, char *why) {
    if (f->kind == kind) return 1;
    return refuse(why, "FRI message: the wire type of %s must be %d, got %d", name, kind, f->kind);
}

/* A number that may be absent. */
static int integer(const struct field *f, const char *name, uint64_t *value, char *why) {
    if (!is_kind(f, VARINT, name, why)) return 0;
    *value = f->number;
    return 1;
}

/* A number of 32 bits; ABSENT stays where there is none. */
static int word32(const struct field *f, const char *name, word *value, char *why) {
    uint64_t found;
    if (!has(f)) return 1;
    if (!integer(f, name, &found, why)) return 0;
    if (found >> 32) return refuse(why, "FRI message: %s must be below 2**32, got %llu", name, (unsigned long long)found);
    *value = (word)found;
    return 1;
}

static int needed32(const struct field *f, const char *name, word *value, char *why) {
    if (!has(f)) return refuse(why, "FRI message: %s is missing", name);
    return word32(f, name, value, why);
}

/* A member of an enumeration, whose members are the bits of `legal`; ABSENT stays where there is none. */
static int member(const struct field *f, unsigned legal, const char *name, word *value, char *why) {
    uint64_t found;
    if (!has(f)) return 1;
    if (!integer(f, name, &found, why)) return 0;
    if (found < 32 && legal >> found & 1) {
        *value = (word)found;
        return 1;
    }
    char members[64] = "";
    for (int i = 0; i < 32; i++)
        if (legal >> i & 1) sprintf(members + strlen(members), "%s%d", *members ? ", " : "", i);
    return refuse(why, "FRI message: %s must be one of %s, got %llu", name, members, (unsigned long long)found);
}

static int real(const struct field *f, const char *name, double *value, char *why) {
    if (!has(f)) return 1;
    if (!is_kind(f, FIXED64, name, why)) return 0;
    memcpy(value, f->bytes.at, 8);
    return 1;
}

/* Read the doubles of a repeated field, packed or not: `least` to `most` of them; how many, or -1. */
static int doubles(struct part p, int tag, const char *name, int exactly, int most_of_them, double *into, char *why) {
    uint64_t found_tag;
    struct field f;
    int found = 0, room = exactly > 0 ? exactly : most_of_them, is_wrong = 0;
    p.begin = p.at;
    while (p.at < p.end) {
        if (*p.at == (tag << 3 | FIXED64) && p.end - p.at > 8 && found < room) { /* a controller sends one by one */
            memcpy(into + found++, p.at + 1, 8);
            p.at += 9;
            continue;
        }
        if (!next_field(&p, &found_tag, &f, why)) return -1;
        if (found_tag != (uint64_t)tag) continue;
        int size = f.kind == FIXED64 || f.kind == BYTES ? (int)(f.bytes.end - f.bytes.at) : 1;
        is_wrong |= size % 8 != 0;
        for (int i = 0; i < size / 8; i++, found++)
            if (found < room) memcpy(into + found, f.bytes.at + 8 * i, 8);
    }
    if (is_wrong) {
        refuse(why, "FRI message: %s must consist of doubles", name);
        return -1;
    }
    if (exactly > 0 && found != exactly) {
        refuse(why, "FRI message: %s must have %d values, got %d", name, exactly, found);
        return -1;
    }
    if (found > room) {
        refuse(why, "FRI message: %s must have at most %d values, got %d", name, room, found);
        return -1;
    }
    return found;
}

/* Number of characters of a text in UTF-8; -1 if it is not. */
static int characters(const uint8_t *at, const uint8_t *end) {
    int count = 0;
    while (at < end) {
        int more = *at < 0x80 ? 0 : *at < 0xc2 ? -1 : *at < 0xe0 ? 1 : *at < 0xf0 ? 2 : *at < 0xf5 ? 3 : -1;
        if (more < 0 || end - at <= more) return -1;
        for (int i = 1; i <= more; i++)
            if ((at[i] & 0xc0) != 0x80) return -1;
        if ((*at == 0xe0 && at[1] < 0xa0) || (*at == 0xed && at[1] > 0x9f) || (*at == 0xf0 && at[1] < 0x90) ||
            (*at == 0xf4 && at[1] > 0x8f))
            return -1;
        at += more + 1;
        count++;
    }
    return count;
}

static int read_name(const struct field *f, struct name *name, char *why) {
    if (!has(f)) return refuse(why, "FRI message: a name is missing");
    if (!is_kind(f, BYTES, "a name", why)) return 0;
    int count = characters(f->bytes.at, f->bytes.end), size = (int)(f->bytes.end - f->bytes.at);
    if (count < 0) return refuse(why, "FRI message: a name is not UTF-8");
    if (count > MAX_NAME) return refuse(why, "FRI message: a name must have at most %d characters, got %d", MAX_NAME, count);
    name->size = size;
    memcpy(name->bytes, f->bytes.at, (size_t)size);
    return 1;
}

static int read_stamp(const struct field *f, struct time_stamp *stamp, char *why) {
    struct field last[TAGS];
    word seconds = ABSENT, nanos = ABSENT;
    stamp->is_given = 0;
    if (!has(f)) return 1;
    if (!is_kind(f, BYTES, "a time stamp", why) || !collect(f->bytes, last, why)) return 0;
    if (!needed32(last + 1, "seconds", &seconds, why) || !needed32(last + 2, "nanoseconds", &nanos, why)) return 0;
    stamp->is_given = 1;
    stamp->seconds = (uint32_t)seconds;
    stamp->nanos = (uint32_t)nanos;
    return 1;
}

static int read_redundancy(const struct field *f, word *strategy, double *value, char *why) {
    struct field last[TAGS];
    *strategy = ABSENT;
    *value = NAN;
    if (!has(f)) return 1;
    if (!is_kind(f, BYTES, "redundancy", why) || !collect(f->bytes, last, why)) return 0;
    if (!member(last + 1, 1u << 0 | 1u << 4, "redundancy strategy", strategy, why)) return 0;
    if (!real(last + 2, "redundancy value", value, why)) return 0;
    if (*strategy == ABSENT || !has(last + 2)) {
        *strategy = ABSENT;
        return refuse(why, "FRI message: redundancy is incomplete");
    }
    return 1;
}

/* Read a pose that was collected: name, seven numbers and a stamp. */
static int read_pose(const struct field *last, struct part p, struct wire_pose *pose, char *why) {
    if (!read_name(last + 1, &pose->name, why)) return 0;
    if (doubles(p, 2, "a transformation", 7, 0, pose->values, why) < 0) return 0;
    if (!read_stamp(last + 3, &pose->stamp, why)) return 0;
    pose->is_given = 1;
    return 1;
}

static int read_signal(struct part p, struct io_value *value, char *why) {
    struct field last[TAGS];
    word type = ABSENT, direction = ABSENT;
    if (!collect(p, last, why)) return 0;
    if (!member(last + 2, 7, "IO type", &type, why) || !member(last + 3, 3, "IO direction", &direction, why)) return 0;
    if (type == ABSENT || direction == ABSENT) return refuse(why, "FRI message: an IO value has no type or no direction");
    value->type = (int)type;
    value->direction = (int)direction;
    value->bits = 0;
    if (type == ANALOG) {
        double number = 0.0;
        if (!real(last + 5, "an analog value", &number, why)) return 0;
        memcpy(&value->bits, &number, 8);
    } else if (has(last + 4)) {
        uint64_t number;
        if (!integer(last + 4, "a digital value", &number, why)) return 0;
        value->bits = (word)number;
    }
    return read_name(last + 1, &value->name, why);
}

static int read_request(struct part p, int version, struct requested_frame *request, char *why) {
    struct field last[TAGS];
    double unused[NUMBERS_OF_A_FRAME];
    if (!collect(p, last, why) || !read_name(last + 1, &request->name, why)) return 0;
    if (doubles(p, 2, "a transformation", 0, fri_has_quaternions(version) ? 7 : 12, unused, why) < 0) return 0;
    return read_stamp(last + 3, &request->stamp, why);
}

/* Read the parts of a repeated field, of which there are at most `most_of_them`; how many, or -1. */
static int read_all(struct part p, int tag, const char *name, int most_of_them, int version, struct message *m) {
    struct part all = p;
    uint64_t found_tag;
    struct field f;
    int found = 0, wrong = ABSENT;
    while (all.at < all.end) {
        if (!next_field(&all, &found_tag, &f, m->why)) return -1;
        if (found_tag != (uint64_t)tag) continue;
        found++;
        if (f.kind != BYTES && wrong == ABSENT) wrong = f.kind;
    }
    if (found > most_of_them) {
        refuse(m->why, "FRI message: there must be at most %d %s, got %d", most_of_them, name, found);
        return -1;
    }
    if (wrong != ABSENT) {
        refuse(m->why, "FRI message: the wire type of %s must be %d, got %d", name, BYTES, wrong);
        return -1;
    }
    struct field unused[TAGS];
    for (all = p; all.at < all.end;) { /* first whether all of them consist of fields */
        if (!next_field(&all, &found_tag, &f, m->why)) return -1;
        if (found_tag == (uint64_t)tag && !collect(f.bytes, unused, m->why)) return -1;
    }
    found = 0;
    while (p.at < p.end) {
        if (!next_field(&p, &found_tag, &f, m->why)) return -1;
        if (found_tag != (uint64_t)tag) continue;
        int is_legal = tag == 8 ? read_signal(f.bytes, m->signal + found, m->why)
                                : read_request(f.bytes, version, m->request + found, m->why);
        if (!is_legal) return -1;
        found++;
    }
    return found;
}

static int read_robot(struct part p, const struct field *last, struct message *m) {
    uint64_t tag, unused;
    struct field f;
    int drives[3] = {0};
    while (p.at < p.end) {
        if (!next_field(&p, &tag, &f, m->why)) return 0;
        if (tag != 5) continue;
        uint8_t single = (uint8_t)f.number;
        const uint8_t *at = f.kind == BYTES ? f.bytes.at : &single, *end = f.kind == BYTES ? f.bytes.end : at + 1;
        if (f.kind != BYTES && f.kind != VARINT) return refuse(m->why, "FRI message: unknown drive state");
        for (; at < end; at++) {
            if (*at > 2) return refuse(m->why, "FRI message: unknown drive state");
            drives[*at] = 1;
        }
    }
    int kinds = drives[0] + drives[1] + drives[2];
    m->drive = kinds == 0 ? ABSENT : kinds > 1 || drives[1] ? 1 : drives[2] ? 2 : 0;
    if (has(last + 1) && !integer(last + 1, "number of joints", &unused, m->why)) return 0;
    return member(last + 2, 15, "safety state", &m->safety, m->why) && member(last + 6, 7, "operation mode", &m->operation, m->why) &&
           member(last + 7, 15, "control mode", &m->control, m->why);
}

static int read_joints(const struct field *f, int array, const char *name, struct message *m) {
    if (!has(f)) return 1;
    if (!is_kind(f, BYTES, name, m->why)) return 0;
    if (doubles(f->bytes, 1, name, AXES, 0, m->joints[PLACE_OF(array)], m->why) < 0) return 0;
    m->known |= BIT_OF(array);
    return 1;
}

static const struct {
    int tag, array;
    const char *text;
} monitored[] = MONITORED;

static int read_monitor(struct part p, const struct field *last, int version, struct message *m) {
    struct field pose[TAGS], whole[TAGS];
    struct wire_pose measured;
    struct time_stamp stamp;
    if (has(last + 9) && (!is_kind(last + 9, BYTES, "measured pose", m->why) || !collect(last[9].bytes, pose, m->why))) return 0;
    if (has(last + 6) && (!is_kind(last + 6, BYTES, "external force", m->why) || !collect(last[6].bytes, whole, m->why))) return 0;
    for (size_t i = 0; i < sizeof monitored / sizeof *monitored; i++)
        if (!read_joints(last + monitored[i].tag, monitored[i].array, monitored[i].text, m)) return 0;
    if (has(last + 6) && doubles(last[6].bytes, 1, "external force", 6, 0, m->wrench, m->why) < 0) return 0;
    int found = has(last + 8) ? read_all(p, 8, "IO values", MAX_IO, version, m) : 0;
    if (found < 0) return 0;
    m->signals = found;
    if (has(last + 9)) {
        if (!read_pose(pose, last[9].bytes, &measured, m->why)) return 0;
        memcpy(m->pose, measured.values, sizeof m->pose);
        m->has_monitored_pose = 1;
    }
    if (!read_redundancy(last + 10, &m->strategy, &m->e1, m->why) || !read_stamp(last + 15, &stamp, m->why)) return 0;
    m->has_monitored_redundancy = m->strategy != ABSENT;
    if (stamp.is_given) m->stamp = (word)stamp.seconds * 1000000000LL + stamp.nanos;
    return 1;
}

static int read_link(const struct field *last, struct message *m) {
    if (!member(last + 1, 31, "session state", &m->state, m->why) || !member(last + 2, 15, "quality", &m->quality, m->why)) return 0;
    if (m->state == ABSENT || m->quality == ABSENT) return refuse(m->why, "FRI message: session state or quality is missing");
    m->has_link = 1;
    return word32(last + 3, "send period", &m->period_ms, m->why) && word32(last + 4, "receive multiplier", &m->multiplier, m->why);
}

static int read_ipo(const struct field *last, struct message *m) {
    struct field pose[TAGS];
    if (has(last + 2) && (!is_kind(last + 2, BYTES, "interpolated pose", m->why) || !collect(last[2].bytes, pose, m->why))) return 0;
    if (!read_joints(last + 1, S_Q_IPO, "interpolated position", m)) return 0;
    if (has(last + 2) && !read_pose(pose, last[2].bytes, &m->ipo_pose, m->why)) return 0;
    return read_redundancy(last + 3, &m->ipo_strategy, &m->ipo_e1, m->why) && member(last + 10, 31, "command mode", &m->mode, m->why) &&
           member(last + 11, 7, "overlay type", &m->overlay, m->why) && real(last + 12, "tracking performance", &m->tracking, m->why);
}

static int read_header(const struct field *f, struct message *m) {
    struct field last[TAGS];
    word id = ABSENT;
    if (!has(f)) return refuse(m->why, "FRI message: no header");
    if (!is_kind(f, BYTES, "header", m->why) || !collect(f->bytes, last, m->why)) return 0;
    if (!word32(last + 1, "message id", &id, m->why)) return 0;
    if (id == ABSENT) return refuse(m->why, "FRI message: the id must be %lld, got None", MONITORING_ID);
    if (id != MONITORING_ID) return refuse(m->why, "FRI message: the id must be %lld, got %lld", MONITORING_ID, (long long)id);
    return needed32(last + 2, "sequence", &m->sequence, m->why) && needed32(last + 3, "reflected", &m->reflected, m->why);
}

static uint32_t crc_table[256];

__attribute__((constructor)) static void make_table(void) {
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int k = 0; k < 8; k++) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
        crc_table[i] = c;
    }
}

static uint32_t crc(const uint8_t *data, int size) {
    uint32_t c = 0xffffffffu;
    while (size--) c = crc_table[(c ^ *data++) & 0xff] ^ (c >> 8);
    return ~c;
}

static uint32_t little(const uint8_t *at) { return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24; }

static int is_framed(const uint8_t *data, int size) { return size >= 8 && little(data) == (uint32_t)size - 8; }

/* Find the message of a datagram. */
static int unwrap(const uint8_t *data, int size, int version, struct part *p, char *why) {
    p->begin = p->at = data;
    p->end = data + size;
    if (fri_is_framed(version)) {
        if (!is_framed(data, size)) {
            if (size > 0 && data[0] == 0x0a)
                return refuse(why, "the other side speaks FRI 1.x or 2.5 (no length before the message), this side FRI 2.7: "
                                   "set the same version on both");
            return refuse(why, "FRI 2.7 datagram of %d bytes: the length before the message is wrong", size);
        }
        p->begin = p->at = data + 4;
        p->end = data + size - 4;
        if (crc(p->at, size - 8) != little(p->end)) return refuse(why, "FRI 2.7 datagram: wrong CRC, the datagram was damaged");
        return 1;
    }
    if (is_framed(data, size))
        return refuse(why, "the other side speaks FRI 2.7 (\"3.0\"), this side FRI %s: set the same version on both",
                      fri_version_names[version]);
    if (size < 1 || data[0] != 0x0a) return refuse(why, "the datagram is no FRI message: it does not begin with a header");
    return 1;
}

/* The version of a controller from one of its messages; ABSENT, and why. 2.7 is framed; monitor data with a commanded position
   is 1.x, any other is 2.5. 1.11 differs from 1.14 only by the absence of IO, so 1.x is taken for 1.14. */
int fri_recognise(const uint8_t *data, int size, char *why) {
    struct part p;
    struct field f, last[TAGS];
    uint64_t tag;
    if (is_framed(data, size)) return unwrap(data, size, V2_7, &p, why) ? V2_7 : ABSENT;
    if (!unwrap(data, size, V1_15, &p, why)) return ABSENT;
    while (p.at < p.end) {
        if (!next_field(&p, &tag, &f, why)) return ABSENT;
        if (tag == 3 && f.kind == BYTES) return !collect(f.bytes, last, why) ? ABSENT : has(last + 3) ? V1_15 : V2_5;
    }
    refuse(why, "the monitoring message has no monitor data: its version cannot be recognised");
    return ABSENT;
}

/* Read a monitoring message; 0, and why, if it is none. */
int fri_decode(const uint8_t *data, int size, int version, struct message *m) {
    struct part p;
    struct field last[TAGS], robot[TAGS], monitor[TAGS], link[TAGS], ipo[TAGS];
    m->has_link = m->has_monitored_pose = m->has_monitored_redundancy = m->signals = m->requests = 0;
    m->known = 0;
    m->period_ms = m->multiplier = m->safety = m->drive = m->operation = m->control = ABSENT;
    m->state = m->quality = m->strategy = m->stamp = m->mode = m->overlay = m->ipo_strategy = ABSENT;
    m->wrench[0] = m->pose[0] = m->e1 = m->tracking = m->ipo_e1 = NAN;
    m->ipo_pose.is_given = 0;
    if (!unwrap(data, size, version, &p, m->why) || !collect(p, last, m->why)) return 0;
    struct {
        int tag;
        struct field *into;
        const char *name;
    } parts[] = {{2, robot, "robot info"}, {3, monitor, "monitor data"}, {4, link, "connection info"}, {5, ipo, "ipo data"}};
    for (int i = 0; i < 4; i++)
        if (has(last + parts[i].tag) && (!is_kind(last + parts[i].tag, BYTES, parts[i].name, m->why) ||
                                         !collect(last[parts[i].tag].bytes, parts[i].into, m->why)))
            return 0;
    if (!read_header(last + 1, m)) return 0;
    if (has(last + 2) && !read_robot(last[2].bytes, robot, m)) return 0;
    if (has(last + 3) && !read_monitor(last[3].bytes, monitor, version, m)) return 0;
    if (has(last + 4) && !read_link(link, m)) return 0;
    if (has(last + 5) && !read_ipo(ipo, m)) return 0;
    int found = has(last + 6) ? read_all(p, 6, "transformations", MAX_TRANSFORMATIONS, version, m) : 0;
    if (found < 0) return 0;
    m->requests = found;
    return 1;
}

/* ----------------------------------------------------------------------------------------------------------- writing */

static uint8_t *put_varint(uint8_t *at, uint64_t value) {
    for (; value > 0x7f; value >>= 7) *at++ = (uint8_t)(value | 0x80);
    *at++ = (uint8_t)value;
    return at;
}

static uint8_t *put_number(uint8_t *at, int tag, uint64_t value) {
    *at++ = (uint8_t)(tag << 3 | VARINT);
    return put_varint(at, value);
}

/* Append `size` bytes with their key and length. */
static uint8_t *put_bytes(uint8_t *at, int tag, const void *bytes, int size) {
    *at++ = (uint8_t)(tag << 3 | BYTES);
    at = put_varint(at, (uint64_t)size);
    memcpy(at, bytes, (size_t)size);
    return at + size;
}

static uint8_t *put_real(uint8_t *at, int tag, double value) {
    *at++ = (uint8_t)(tag << 3 | FIXED64);
    memcpy(at, &value, 8);
    return at + 8;
}

/* A joint array as the controllers write it: a key before each value. */
static uint8_t *put_joints(uint8_t *at, int tag, const double *values) {
    *at++ = (uint8_t)(tag << 3 | BYTES);
    *at++ = 9 * AXES;
    for (int i = 0; i < AXES; i++) at = put_real(at, 1, values[i]);
    return at;
}

static uint8_t *put_stamp(uint8_t *at, const struct time_stamp *stamp) {
    uint8_t inner[16], *end = put_number(put_number(inner, 1, stamp->seconds), 2, stamp->nanos);
    return put_bytes(at, 3, inner, (int)(end - inner));
}

static uint8_t *put_transformation(uint8_t *at, int tag, const struct name *name, const double *values, int count,
                                   const struct time_stamp *stamp) {
    uint8_t inner[NAME_BYTES + 8 * NUMBERS_OF_A_FRAME + 32], *end = put_bytes(inner, 1, name->bytes, name->size);
    end = put_bytes(end, 2, values, 8 * count);
    if (stamp->is_given) end = put_stamp(end, stamp);
    return put_bytes(at, tag, inner, (int)(end - inner));
}

/* Encode an output of the command; how many bytes. */
int fri_put_output(const struct io_value *signal, word bits, uint8_t *into) {
    uint8_t inner[NAME_BYTES + 32], *end = put_bytes(inner, 1, signal->name.bytes, signal->name.size);
    end = put_number(put_number(end, 2, (uint64_t)signal->type), 3, OUTPUT);
    double real_value;
    memcpy(&real_value, &bits, 8);
    end = signal->type == ANALOG ? put_real(end, 5, real_value) : put_number(end, 4, (uint64_t)bits);
    return (int)(put_bytes(into, 5, inner, (int)(end - inner)) - into);
}

/* Encode a frame of the command; how many bytes. */
int fri_put_frame(const struct name *name, const double *values, int count, const struct time_stamp *stamp, uint8_t *into) {
    return (int)(put_transformation(into, 4, name, values, count, stamp) - into);
}

/* Write a command; its size, which may be more than a datagram may have. */
int fri_encode(const struct answer *a, int version, uint8_t *into) {
    uint8_t body[REPLY], *end = body, header[32], *at = into + (fri_is_framed(version) ? 4 : 0), *begin = at;
    if (a->q) end = put_joints(end, 1, a->q);
    if (a->wrench) {
        uint8_t inner[64];
        end = put_bytes(end, 2, inner, (int)(put_bytes(inner, 1, a->wrench, 48) - inner));
    }
    if (a->tau) end = put_joints(end, 3, a->tau);
    memcpy(end, a->exchange, (size_t)a->exchange_size);
    end += a->exchange_size;
    if (a->pose) end = put_transformation(end, 6, &a->pose->name, a->pose_values, 7, &a->pose->stamp);
    if (a->strategy != ABSENT) {
        uint8_t inner[16];
        end = put_bytes(end, 7, inner, (int)(put_real(put_number(inner, 1, (uint64_t)a->strategy), 2, a->e1) - inner));
    }
    uint8_t *head = put_number(put_number(put_number(header, 1, COMMAND_ID), 2, (uint64_t)a->sent), 3, (uint64_t)a->reflected);
    at = put_bytes(at, 1, header, (int)(head - header));
    if (end > body) at = put_bytes(at, 2, body, (int)(end - body));
    int length = (int)(at - begin);
    if (fri_is_framed(version)) {
        uint32_t size = (uint32_t)length, sum = crc(begin, length);
        memcpy(into, &size, 4);
        memcpy(at, &sum, 4);
        length += 8;
    }
    return length;
}
