#include "drivers/transport/can_socket.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>
#include <utility>

namespace perimap {
namespace {

// The kernel stamps received frames on CLOCK_REALTIME.
Instant monotonic_of_realtime(const std::timespec& stamp) {
  std::timespec utc{};
  clock_gettime(CLOCK_REALTIME, &utc);
  const Instant now = MonotonicClock::now();
  const Duration age =
      std::chrono::seconds(utc.tv_sec - stamp.tv_sec) + std::chrono::nanoseconds(utc.tv_nsec - stamp.tv_nsec);
  // A step of the wall clock between stamp and reading would show here; such an age is not believed.
  return age >= Duration(0) && age < std::chrono::seconds(1) ? now - age : now;
}

std::string reason(int error) {
  switch (error) {
    case EAFNOSUPPORT:
      return "this kernel has no CAN (modprobe can_raw)";
    case ENODEV:
      return "no such CAN interface (ip link)";
    case ENETDOWN:
      return "the interface is down (ip link set INTERFACE up type can bitrate ...)";
    case EPERM:
    case EACCES:
      return "permission denied";
    default:
      return std::generic_category().message(error);
  }
}

}  // namespace

// NOLINTBEGIN(cppcoreguidelines-pro-type-union-access): the kernel's own types

Expected<CanSocket> CanSocket::open(const std::string& interface_name, std::uint32_t identifier, bool extended) {
  const auto refuse = [&interface_name](int error) {
    return fail(fmt::format("can:{}: {}", interface_name, reason(error)));
  };
  Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!socket) return refuse(errno);

  ifreq request{};
  interface_name.copy(request.ifr_name, sizeof request.ifr_name - 1);
  if (::ioctl(socket.get(), SIOCGIFINDEX, &request) != 0) return refuse(errno);
  const int index = request.ifr_ifindex;
  if (::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0) return refuse(errno);
  if ((request.ifr_flags & IFF_UP) == 0) return refuse(ENETDOWN);

  can_filter filter{};
  filter.can_id = identifier | (extended ? CAN_EFF_FLAG : 0U);
  filter.can_mask = CAN_EFF_FLAG | CAN_RTR_FLAG | (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  const can_err_mask_t errors = CAN_ERR_MASK;
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  const int on = 1;
  const int buffer_bytes = 1 << 20;
  (void)::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
  if (::setsockopt(socket.get(), SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter) != 0 ||
      ::setsockopt(socket.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_TIMESTAMPING, &stamps, sizeof stamps) != 0 ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0) {
    return refuse(errno);
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return refuse(errno);
  return CanSocket(std::move(socket), interface_name);
}

Expected<std::optional<CanFrame>> CanSocket::receive() {
  can_frame raw{};
  iovec part{&raw, sizeof raw};
  alignas(cmsghdr) std::array<char, 256> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(socket_.get(), &message, 0);
  if (got < 0) {
    if (errno == EAGAIN || errno == EINTR) return std::optional<CanFrame>();
    return fail(fmt::format("can:{}: {}", name_, reason(errno)));
  }
  CanFrame frame;
  frame.arrival = MonotonicClock::now();
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET) continue;
    if (header->cmsg_type == SO_TIMESTAMPING) {
      std::timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(header), sizeof stamp);  // the first of three: the software stamp
      if (stamp.tv_sec != 0) frame.arrival = monotonic_of_realtime(stamp);
    } else if (header->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&dropped_, CMSG_DATA(header), sizeof dropped_);
    }
  }
  if (got != static_cast<ssize_t>(sizeof raw)) return std::optional<CanFrame>();
  frame.error = (raw.can_id & CAN_ERR_FLAG) != 0;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.identifier = raw.can_id & CAN_EFF_MASK;
  frame.length = std::min<std::uint8_t>(raw.can_dlc, CAN_MAX_DLEN);
  std::copy_n(raw.data, frame.length, frame.data.begin());
  frame.dropped_before = dropped_;
  return std::optional<CanFrame>(frame);
}

Expected<bool> CanSocket::send(const CanFrame& frame) {
  can_frame raw{};
  raw.can_id = frame.identifier | (frame.extended ? CAN_EFF_FLAG : 0U);
  raw.can_dlc = std::min<std::uint8_t>(frame.length, CAN_MAX_DLEN);
  std::copy_n(frame.data.begin(), raw.can_dlc, raw.data);
  if (::write(socket_.get(), &raw, sizeof raw) == static_cast<ssize_t>(sizeof raw)) return true;
  if (errno == EAGAIN || errno == ENOBUFS || errno == EINTR || errno == ENETDOWN) return false;
  return fail(fmt::format("can:{}: {}", name_, reason(errno)));
}

// NOLINTEND(cppcoreguidelines-pro-type-union-access)

}  // namespace perimap
