/* The loop of the FRI client: receive datagrams, answer them, until the arm is at rest after the end was asked for.

   fri_run returns to Python where Python has something to do (see the enum of what a run returns): call a law in Python, name the
   failure of a compiled one, collect garbage while nothing arrives. A controller is accepted by its address; another one only
   after the session has ended or fallen silent, so that a program on the network cannot take a running session over. */
#include <arpa/inet.h>
#include <errno.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "fri.h"

/* The loop accepts a sender with another address after this long without a message of the previous one [ns]. */
#define SILENT 1000000000LL
/* It accepts another port of the same address, that of a restarted controller, after so many periods without a message, and after
   at least this long [ns]: not at once, so that another program there cannot interrupt a running session. */
enum { SILENT_PERIODS = 3 };
#define SILENT_PORT 100000000LL
/* Longest wait for the arm to come to rest before the loop ends; so long without a message nothing is commanded any more [ns]. */
#define BRAKING_TIME 3000000000LL
#define NO_MESSAGES 250000000LL
/* The loop checks every so many datagrams whether the user's process is alive. */
enum { CHECK_EVERY = 256 };

static word clock_now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void reply(struct fri_loop *l, int size) {
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)l->peer_port)};
    to.sin_addr.s_addr = l->peer;
    sendto((int)l->seam->sock, l->reply, (size_t)size, 0, (struct sockaddr *)&to, sizeof to);
}

/* Receive a datagram of at most BUFFER bytes, its sender and the time of receipt, by the kernel where it has one; its size, or -1. */
static ssize_t receive(int sock, int flags, uint8_t *into, struct sockaddr_in *from, word *received) {
    char control[128];
    struct iovec part = {into, BUFFER};
    struct msghdr message = {.msg_name = from, .msg_namelen = sizeof *from, .msg_iov = &part, .msg_iovlen = 1,
                             .msg_control = control, .msg_controllen = sizeof control};
    ssize_t size = recvmsg(sock, &message, flags);
    if (size < 0) return size;
    *received = clock_now(CLOCK_MONOTONIC);
#ifdef SCM_TIMESTAMPNS
    for (struct cmsghdr *head = CMSG_FIRSTHDR(&message); head; head = CMSG_NXTHDR(&message, head)) {
        struct timespec stamp;
        if (head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_TIMESTAMPNS) continue;
        memcpy(&stamp, CMSG_DATA(head), sizeof stamp);
        word age = clock_now(CLOCK_REALTIME) - stamp.tv_sec * 1000000000LL - stamp.tv_nsec;
        if (age >= 0 && age < 10000000000LL) *received -= age; /* an older one means that the wall clock was set */
    }
#endif
    return size;
}

/* The floor of a reply on this machine: send `turns` datagrams back, with the time from receipt to reply of each [ns]; how
   many came. */
word fri_echo(int sock, word turns, word *took) {
    uint8_t datagram[BUFFER];
    for (word turn = 0; turn < turns; turn++) {
        struct sockaddr_in from;
        word received;
        ssize_t size = receive(sock, 0, datagram, &from, &received);
        if (size < 0) return turn;
        sendto(sock, datagram, (size_t)size, 0, (struct sockaddr *)&from, sizeof from);
        took[turn] = clock_now(CLOCK_MONOTONIC) - received;
    }
    return turns;
}

/* Receive the next datagram. The thread sleeps until it arrives; with `busy_poll` it wakes shortly before the message is due, and
   then asks for it again and again: no waking of the thread adds to the latency. It sleeps again if the message is late. */
static ssize_t next_message(struct fri_loop *l, struct sockaddr_in *from, word *received) {
    int sock = (int)l->seam->sock;
    word polls = (word)(1e9 * l->seam->busy_poll), due = l->session.received + l->session.period;
    if (polls && l->session.period) {
        word asleep = due - polls - clock_now(CLOCK_MONOTONIC);
        struct pollfd waiting = {.fd = sock, .events = POLLIN};
        struct timespec rest = {.tv_sec = asleep / 1000000000LL, .tv_nsec = asleep % 1000000000LL};
#ifdef __linux__
        if (asleep > 0) ppoll(&waiting, 1, &rest, NULL);
#else
        if (asleep > 0) poll(&waiting, 1, (int)(asleep / 1000000)), (void)rest;
#endif
        while (clock_now(CLOCK_MONOTONIC) < due + polls) {
            ssize_t size = receive(sock, MSG_DONTWAIT, l->datagram, from, received);
            if (size >= 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return size;
        }
    }
    return receive(sock, 0, l->datagram, from, received);
}

/* Whether to accept another sender: only if the session of the previous one has ended or it is silent. */
static int accept_sender(struct fri_loop *l, const struct sockaddr_in *from, int size, word now) {
    char unused[TEXT], address[INET_ADDRSTRLEN];
    const struct session *s = &l->session;
    uint32_t sender = from->sin_addr.s_addr;
    if (l->seam->remote && sender != (uint32_t)l->seam->remote) return 0;
    if (l->peer_port) {
        word patience = SILENT;
        if (sender == l->peer && fri_recognise(l->datagram, size, unused) != ABSENT) {
            patience = SILENT_PERIODS * s->period;
            if (patience < SILENT_PORT) patience = SILENT_PORT;
        }
        if (s->state != IDLE && now - s->received < patience) return 0;
        fri_forget_controller(l);
    }
    l->peer = sender;
    l->peer_port = ntohs(from->sin_port);
    inet_ntop(AF_INET, &from->sin_addr, address, sizeof address);
    fri_report(l, KIND_CLIENT, now, "listening to %s:%d", address, l->peer_port);
    return 1;
}

/* Whether the loop has ended; the arm brakes from the moment on at which it has to end. */
static int is_over(struct fri_loop *l, word now) {
    if (!l->braking_until) {
        if (!l->header[H_STOP] && (!l->seam->parent || getppid() == (pid_t)l->seam->parent)) return 0;
        fri_end(l);
        l->braking_until = now + BRAKING_TIME;
    }
    return fri_may_end(l) || now - l->session.received > NO_MESSAGES || now > l->braking_until;
}

/* After a turn: send the answer, publish, and find out what comes next; 0: go on. */
static int conclude(struct fri_loop *l, int answer) {
    if (answer > 0) reply(l, answer);
    word now = clock_now(CLOCK_MONOTONIC);
    fri_finish(l, now);
    if (l->seam->law_status != LAW_OK && !l->seam->law_reported) return LAW_FAILED;
    if (l->header[H_RELEASE]) fri_end(l);
    if ((l->header[H_STOP] || ++l->checked % CHECK_EVERY == 0) && is_over(l, now)) return ENDED;
    return 0;
}

/* Receive and answer one datagram, or wait for one in vain; 0: it was answered, or was a stranger's. */
static int take_one(struct fri_loop *l) {
    struct sockaddr_in from;
    word received;
    ssize_t size = next_message(l, &from, &received);
    if (size < 0) {
        if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR && errno != ECONNREFUSED) {
            l->seam->error = errno;
            return SOCKET_ERROR;
        }
        word now = l->header[H_BEAT] = clock_now(CLOCK_MONOTONIC);
        return is_over(l, now) ? ENDED : TIMEOUT;
    }
    int is_peer = l->peer_port && from.sin_addr.s_addr == l->peer && ntohs(from.sin_port) == l->peer_port;
    if (!is_peer && !accept_sender(l, &from, (int)size, received)) /* a flood of strangers must not keep the loop */
        return ++l->checked % CHECK_EVERY == 0 && is_over(l, clock_now(CLOCK_MONOTONIC)) ? ENDED : 0;
    int answer = fri_turn(l, l->datagram, (int)size, received);
    return answer == LAW ? CALL_LAW : conclude(l, answer);
}

/* Answer one datagram, or the law whose call the last step asked for; what `take_one` returns. For clients in C++. */
int fri_step(struct fri_loop *l, int is_called) { return is_called ? conclude(l, fri_answer(l)) : take_one(l); }

/* Receive and answer until Python has something to do. `is_called`: the law in Python was called, its command is to be sent. */
int fri_run(struct fri_loop *l, int is_called) {
    int next = is_called ? conclude(l, fri_answer(l)) : 0;
    while (!next) next = take_one(l);
    return next;
}
