"""Cases with a known truth: moved CTs and X-rays of them."""
